# Finds every package that a module links; scripts/packages.txt lists the Debian names. This file is
# installed too: find_package(pangea) includes it to find the same packages.
find_package(Boost 1.74 REQUIRED)
find_package(OpenSSL 3.0 REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)

# Debian's Ceres, and its search for any BLAS, name ATLAS (libf77blas, libatlas) as libraries to link. A
# program that links them computes with ATLAS, whichever libblas.so.3 the machine has: they come first.
block()
  set(BLA_VENDOR Generic)
  find_package(Ceres 2.1 REQUIRED)
endblock()
get_target_property(ceres_libraries Ceres::ceres INTERFACE_LINK_LIBRARIES)
list(FILTER ceres_libraries EXCLUDE REGEX "/lib(f77blas|atlas)[.]")
set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES "${ceres_libraries}")

# Debian's LCM has no CMake package.
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
add_library(lcm::lcm UNKNOWN IMPORTED)
set_target_properties(lcm::lcm PROPERTIES IMPORTED_LOCATION ${LCM_LIBRARY}
  INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})

# libqrencode, libsodium and zstd have no CMake packages either.
foreach(package qrencode sodium zstd)
  find_path(${package}_INCLUDE_DIR ${package}.h REQUIRED)
  find_library(${package}_LIBRARY ${package} REQUIRED)
  add_library(${package}::${package} UNKNOWN IMPORTED)
  set_target_properties(${package}::${package} PROPERTIES
    IMPORTED_LOCATION ${${package}_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${${package}_INCLUDE_DIR})
endforeach()

# Debian's CMake package of libapriltag asks for OpenCV, which only its examples use.
find_path(apriltag_INCLUDE_DIR apriltag/apriltag.h REQUIRED)
find_library(apriltag_LIBRARY apriltag REQUIRED)
add_library(apriltag::apriltag UNKNOWN IMPORTED)
set_target_properties(apriltag::apriltag PROPERTIES
  IMPORTED_LOCATION ${apriltag_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${apriltag_INCLUDE_DIR})

# CHOLMOD is the only part of SuiteSparse that the modules link directly.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
add_library(suitesparse::cholmod UNKNOWN IMPORTED)
set_target_properties(suitesparse::cholmod PROPERTIES
  IMPORTED_LOCATION ${CHOLMOD_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${CHOLMOD_INCLUDE_DIR})

# OpenCV's CMake package is in Debian's libopencv-dev only, which installs 330 MB more than the parts
# that are used. A SYSTEM target silences warnings in its headers.
foreach(part core imgproc features2d video calib3d imgcodecs)
  find_library(opencv_${part}_LIBRARY opencv_${part} REQUIRED)
endforeach()
find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
add_library(pangea_opencv INTERFACE IMPORTED)
target_include_directories(pangea_opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIR})
target_link_libraries(pangea_opencv INTERFACE ${opencv_core_LIBRARY} ${opencv_imgproc_LIBRARY}
  ${opencv_features2d_LIBRARY} ${opencv_video_LIBRARY} ${opencv_calib3d_LIBRARY})

# For libraries that write image files or read them in any format. A target of its own, because
# imgcodecs loads GDAL and many other libraries.
add_library(pangea_image_files INTERFACE IMPORTED)
target_link_libraries(pangea_image_files INTERFACE pangea_opencv ${opencv_imgcodecs_LIBRARY})
