# Compiler options, and the functions with which every module defines its libraries, programs and
# tests.

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_compile_options(-Wall -Wextra -Wpedantic -Werror)
# GCC collects its garbage only above 1 GB (kB here): a tenth less time for a fifth more memory.
add_compile_options($<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1000000>)
# x86-64-v2 has popcnt, which Hamming distances need. A newer level would change the alignment of
# Eigen types, which must agree with Debian's Ceres. -ffp-contract=off: one binary must give the
# same bytes on every machine. Hot loops are compiled for AVX2 in addition (vio/vector_clones.h).
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  add_compile_options(-march=x86-64-v2 -ffp-contract=off)
endif()
if(PANGEA_SANITIZE)
  # -g1 gives the line numbers that a report needs, and builds twice as fast as -g.
  # GCC 12 warns wrongly of uninitialised values in instrumented std::function and std::regex.
  add_compile_options(-fsanitize=${PANGEA_SANITIZE} -fno-omit-frame-pointer -O1 -g1
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  # The thread sanitizer does not support Boost.Asio's fences, and GCC warns of them. Asio holds
  # locks besides, so that no race is reported wrongly.
  if(PANGEA_SANITIZE STREQUAL "thread")
    add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
  endif()
  add_link_options(-fsanitize=${PANGEA_SANITIZE})
  if(PANGEA_SANITIZE MATCHES "fuzzer")  # a report must end the run, or nobody notices it
    add_compile_options(-fno-sanitize-recover=all -D_GLIBCXX_ASSERTIONS
      -fsanitize-ignorelist=${CMAKE_SOURCE_DIR}/tests/fuzz/sanitizer_ignored.txt)
  endif()
endif()

find_program(PYTHON3 python3 REQUIRED)  # for tests

# Builds everything that users run and that `cmake --install` installs, except tests and web pages.
add_custom_target(programs)

# Sets `out` to the include path of one module: a folder that contains a link to this module only. A
# library therefore sees the headers of the modules that it depends on, directly or indirectly, and
# no others: an include that violates the layers does not compile.
function(pangea_include_root out)
  file(RELATIVE_PATH module ${CMAKE_SOURCE_DIR}/modules ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/.*" "" module ${module})
  if(module STREQUAL "..")  # tests, benches and examples offer no headers to others
    set(${out} "" PARENT_SCOPE)
    return()
  endif()
  set(root ${CMAKE_BINARY_DIR}/include_roots/${module})
  file(MAKE_DIRECTORY ${root})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/modules/${module} ${root}/${module} SYMBOLIC)
  set(${out} ${root} PARENT_SCOPE)
endfunction()

# pangea_library(name [INTERNAL] [SOURCES ...] DEPENDS ...) defines a static library, or without
# SOURCES a header-only one. Its headers are included as "<module>/<header>.h". It is installed as
# pangea::<name without pangea_>, unless it is INTERNAL (e.g. for tests and benches).
function(pangea_library name)
  cmake_parse_arguments(ARG "INTERNAL" "" "SOURCES;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
  else()
    add_library(${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  pangea_include_root(root)
  target_include_directories(${name} ${scope} $<BUILD_INTERFACE:${root}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/pangea>)
  target_compile_features(${name} ${scope} cxx_std_20)
  target_link_libraries(${name} ${scope} ${ARG_DEPENDS})
  if(NOT ARG_INTERNAL)
    string(REGEX REPLACE "^pangea_" "" short ${name})
    set_target_properties(${name} PROPERTIES EXPORT_NAME ${short})
    install(TARGETS ${name} EXPORT pangea ARCHIVE COMPONENT dev)
    if(ARG_SOURCES)
      add_dependencies(programs ${name})
    endif()
  endif()
endfunction()

# Makes a program's manual page from its --help, if help2man is installed.
find_program(HELP2MAN help2man)
function(pangea_manual_page name)
  if(NOT HELP2MAN OR PANGEA_SANITIZE)
    return()
  endif()
  set(maker ${CMAKE_SOURCE_DIR}/packaging/manual_page)
  set(page ${CMAKE_BINARY_DIR}/man/${name}.1.gz)
  add_custom_command(OUTPUT ${page}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/man
    COMMAND ${maker} $<TARGET_FILE:${name}> ${PROJECT_VERSION} ${page}
    DEPENDS ${name} ${maker} COMMENT "Manual page of ${name}")
  add_custom_target(${name}_manual_page ALL DEPENDS ${page})
  add_dependencies(programs ${name}_manual_page)
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
endfunction()

# pangea_program(name [INTERNAL] SOURCES ... DEPENDS ...) defines a program, and tests that its --help
# and --version work. An INTERNAL program (e.g. a bench) has no version, and is neither installed nor
# one of `programs`.
function(pangea_program name)
  if(EMSCRIPTEN)
    return()
  endif()
  cmake_parse_arguments(ARG "INTERNAL" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  pangea_include_root(root)
  target_include_directories(${name} PRIVATE ${root})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} CLI11::CLI11)
  # The expensive computations are in the libraries; with -O1, CLI11 compiles a third faster.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
  if(NOT ARG_INTERNAL)
    add_dependencies(programs ${name})
    install(TARGETS ${name} RUNTIME COMPONENT runtime)
    # Bash looks for a file that has the program's name.
    install(FILES ${CMAKE_SOURCE_DIR}/scripts/completion/pangea.bash RENAME ${name} COMPONENT runtime
      DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
    pangea_manual_page(${name})
    add_test(NAME ${name}.version COMMAND ${name} --version)
    set_tests_properties(${name}.version PROPERTIES LABELS unit
      PASS_REGULAR_EXPRESSION "^${name} ${PROJECT_VERSION}\n")
  endif()
  add_test(NAME ${name}.help COMMAND ${name} --help)
  set_tests_properties(${name}.help PROPERTIES LABELS unit)
endfunction()

# Tests write into a folder of this build tree, so that the tests of two trees do not disturb each
# other.
set(test_files ${CMAKE_BINARY_DIR}/tmp)
file(MAKE_DIRECTORY ${test_files})

# pangea_test_program(name SOURCES ... DEPENDS ...) defines a program of GoogleTest's tests.
function(pangea_test_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  # A test spends its time in the libraries; with -O1, its own code compiles a third faster. Most of
  # that time is headers: larger units than the libraries' parse them less often.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${name} PROPERTIES UNITY_BUILD_BATCH_SIZE 25)
  pangea_include_root(root)
  target_include_directories(${name} PRIVATE ${root})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE PANGEA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    PANGEA_BINARY_DIR="${CMAKE_BINARY_DIR}")
endfunction()

# pangea_test_entry(name COMMAND ... [LABEL unit|system|slow] [TIMEOUT s] [COST s]) defines a test of
# ctest. The label is unit and the timeout 120 s if they are not given; what costs more starts earlier.
function(pangea_test_entry name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT;COST" "COMMAND" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(PANGEA_SANITIZE)  # tests are up to ten times slower
    math(EXPR ARG_TIMEOUT "10 * ${ARG_TIMEOUT}")
  endif()
  add_test(NAME ${name} COMMAND ${ARG_COMMAND})
  set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT}
    ENVIRONMENT TMPDIR=${test_files})
  if(ARG_COST)
    set_tests_properties(${name} PROPERTIES COST ${ARG_COST})
  endif()
endfunction()

# pangea_test(name SOURCES ... DEPENDS ... [LABEL ...] [TIMEOUT s] [COST s]) defines both, a program and
# a test that runs it. A module has one or two: each more parses the same headers again.
function(pangea_test name)
  if(EMSCRIPTEN)
    return()
  endif()
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT;COST" "SOURCES;DEPENDS" ${ARGN})
  pangea_test_program(${name} SOURCES ${ARG_SOURCES} DEPENDS ${ARG_DEPENDS})
  pangea_test_entry(${name} COMMAND ${name}
    LABEL ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT} COST ${ARG_COST})
endfunction()
