# Every package that a module links; scripts/packages.txt lists the Debian names. Installed too: it
# is how find_package(pangea) finds them again.
find_package(Boost 1.74 REQUIRED)
find_package(OpenSSL 3.0 REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Ceres 2.1 REQUIRED)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs features2d video calib3d)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)

# Debian's LCM has no CMake package.
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
add_library(lcm::lcm UNKNOWN IMPORTED)
set_target_properties(lcm::lcm PROPERTIES IMPORTED_LOCATION ${LCM_LIBRARY}
  INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})

# Neither have libqrencode, libsodium and zstd.
foreach(package qrencode sodium zstd)
  find_path(${package}_INCLUDE_DIR ${package}.h REQUIRED)
  find_library(${package}_LIBRARY ${package} REQUIRED)
  add_library(${package}::${package} UNKNOWN IMPORTED)
  set_target_properties(${package}::${package} PROPERTIES
    IMPORTED_LOCATION ${${package}_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${${package}_INCLUDE_DIR})
endforeach()

# Of SuiteSparse only CHOLMOD.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
add_library(suitesparse::cholmod UNKNOWN IMPORTED)
set_target_properties(suitesparse::cholmod PROPERTIES
  IMPORTED_LOCATION ${CHOLMOD_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${CHOLMOD_INCLUDE_DIR})

# OpenCV's config sets plain include directories; as a SYSTEM target its headers stay quiet.
add_library(pangea_opencv INTERFACE IMPORTED)
target_include_directories(pangea_opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})
target_link_libraries(pangea_opencv INTERFACE
  opencv_core opencv_imgproc opencv_features2d opencv_video opencv_calib3d)

# What writes images or reads them in any format: it loads GDAL and much else.
add_library(pangea_image_files INTERFACE IMPORTED)
target_link_libraries(pangea_image_files INTERFACE pangea_opencv opencv_imgcodecs)
