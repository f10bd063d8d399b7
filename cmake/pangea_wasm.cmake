# Compiler flags and packages for the agent as WebAssembly (preset wasm). PANGEA_WASM_LIBRARIES is
# the folder that scripts/wasm_libraries prints. Header-only libraries are taken from this machine.
set(PANGEA_WASM_LIBRARIES "" CACHE PATH "What scripts/wasm_libraries has built")
if(NOT EXISTS ${PANGEA_WASM_LIBRARIES}/complete)
  message(FATAL_ERROR "Build with scripts/build wasm: PANGEA_WASM_LIBRARIES='${PANGEA_WASM_LIBRARIES}' holds no libraries")
endif()
# -msse2: Eigen has no vector code for WebAssembly, but the compiler translates SSE2.
# -fgnuc-version: Eigen contains x86 assembler, which does not compile here. Some of it is used if
#   10 * major + minor of GCC's version is below 63, the rest if major is 6 or more. 5.13 avoids
#   both.
# -mnontrapping-fptoint, -msign-ext: one instruction in place of several. Every browser that has
#   vector instructions has these too.
# -enable-interleaved-mem-accesses: without it the compiler reads and writes pairs lane by lane.
# -no-stack-coloring: with stack colouring clang 14 lets two matrices that are both in use share
#   memory. A preintegration's Jacobians and covariance were up to 11 % off (the test phone.wasm
#   compares them).
add_compile_options(-msimd128 -msse2 -mnontrapping-fptoint -msign-ext -fgnuc-version=5.13 -fwasm-exceptions -ffp-contract=off
  "SHELL:-mllvm -enable-interleaved-mem-accesses=true" "SHELL:-mllvm -no-stack-coloring")
add_link_options(-msimd128 -fwasm-exceptions)
# The order in which Eigen sums depends on these values, and the last bit of a result on that order.
# They are those of x86-64, so that a phone computes exactly the same as this machine.
add_compile_definitions(EIGEN_DEFAULT_L1_CACHE_SIZE=32768 EIGEN_MAX_STATIC_ALIGN_BYTES=16 EIGEN_ARCH_DEFAULT_NUMBER_OF_REGISTERS=16)

# Only these headers of /usr/include are used: others are specific to this machine's architecture.
set(wasm_headers ${CMAKE_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${wasm_headers})
foreach(package boost CLI fmt lcm nlohmann)
  file(CREATE_LINK /usr/include/${package} ${wasm_headers}/${package} SYMBOLIC)
endforeach()
file(TOUCH ${wasm_headers}/mmintrin.h)  # Eigen includes it; the compiler's own is an error here

# wasm_package(target [LIBRARY]...) defines the target that pangea_dependencies.cmake defines
# elsewhere.
function(wasm_package target)
  add_library(${target} INTERFACE IMPORTED)
  target_include_directories(${target} SYSTEM INTERFACE ${wasm_headers} ${PANGEA_WASM_LIBRARIES}/include)
  list(TRANSFORM ARGN REPLACE "(.+)" "${PANGEA_WASM_LIBRARIES}/lib/lib\\1.a" OUTPUT_VARIABLE libraries)
  target_link_libraries(${target} INTERFACE ${libraries})
endfunction()
wasm_package(pangea_opencv opencv_video opencv_features2d opencv_imgproc opencv_core z)
wasm_package(sodium::sodium sodium)
wasm_package(zstd::zstd zstd)
wasm_package(ZLIB::ZLIB z)
wasm_package(yaml-cpp yaml-cpp)
wasm_package(Boost::headers)
wasm_package(CLI11::CLI11)
wasm_package(fmt::fmt)
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY)
wasm_package(lcm::lcm)
wasm_package(JPEG::JPEG)  # only named as a dependency: the agent reads no image files
wasm_package(PNG::PNG)
wasm_package(Eigen3::Eigen)
target_include_directories(Eigen3::Eigen SYSTEM INTERFACE /usr/include/eigen3)
