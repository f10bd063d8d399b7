# `cpack -G DEB` in the build folder makes two Debian packages: pangea has the programs,
# libpangea-dev the libraries and headers.
set(CPACK_PACKAGE_NAME pangea)
set(CPACK_PACKAGE_VENDOR Pangea)
set(CPACK_PACKAGE_CONTACT "Pangea maintainers <pangea@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Collaborative visual-inertial SLAM for phones")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL runtime dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME pangea)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
  "Several phones map a building together: odometry, the link to the server, the server's\n\
processes, scripted sessions, replay, the viewer; on the LCM message bus.")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
# Without it, CHOLMOD computes with any BLAS; the reference one and ATLAS are slow (modules/blas).
set(openblas "libopenblas0-serial | libopenblas0-pthread | libopenblas0-openmp")
# Programs that ours start by name: every session starts lcm-logger, and its report gnuplot.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "liblcm-bin, gnuplot-nox | gnuplot, ${openblas}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "python3")  # for the Python package pangea
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "liblcm-java, openjdk-17-jre, libjchart2d-java, nats-server")
set(scripts ${CMAKE_SOURCE_DIR}/packaging/debian)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm)

# Whoever links our static libraries needs the development packages of the libraries that they use.
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libpangea-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEV_DESCRIPTION
  "The modules as libraries for find_package(pangea), their headers, and the messages\n\
(lcmtypes) with their C++ headers.")
string(JOIN ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ${openblas} libboost-dev libceres-dev libcli11-dev libfmt-dev
  libapriltag-dev libjpeg-dev liblcm-dev libopencv-calib3d-dev libopencv-video-dev libpng-dev libqrencode-dev libsodium-dev libssl-dev libsuitesparse-dev libyaml-cpp-dev libzstd-dev nlohmann-json3-dev zlib1g-dev)
include(CPack)
