# `cpack -G DEB` in the build folder: pangea (what people run) and libpangea-dev (what they link).
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
# Started by name: lcm-logger by every session, gnuplot by its report.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "liblcm-bin, gnuplot-nox | gnuplot")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "python3")  # for the package pangea of Python
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "liblcm-java, openjdk-17-jre, libjchart2d-java, nats-server")
set(scripts ${CMAKE_SOURCE_DIR}/packaging/debian)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm)

# Static libraries need the development packages of what they are made of.
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libpangea-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEV_DESCRIPTION
  "The modules as libraries for find_package(pangea), their headers, and the messages\n\
(lcmtypes) with their C++ headers.")
string(JOIN ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS libboost-dev libceres-dev libcli11-dev libfmt-dev
  libjpeg-dev liblcm-dev libopencv-dev libpng-dev libqrencode-dev libsodium-dev libssl-dev libsuitesparse-dev libyaml-cpp-dev libzstd-dev nlohmann-json3-dev zlib1g-dev)
include(CPack)
