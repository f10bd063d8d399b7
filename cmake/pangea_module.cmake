# Helpers that make every module look the same.

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

add_compile_options(-Wall -Wextra -Wpedantic -Werror)
# popcnt for Hamming distances. Nothing newer: Debian's Ceres and Eigen types must agree on
# alignment, and the same binary must give the same bytes on every machine; hot loops are compiled
# for AVX2 besides (vio/vector_clones.h).
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  add_compile_options(-march=x86-64-v2 -ffp-contract=off)
endif()
if(PANGEA_SANITIZE)
  # Lines are enough to find a place (-g1), and twice as fast to build as all of -g.
  # GCC 12 sees uninitialised values in instrumented std::function and std::regex that are none.
  add_compile_options(-fsanitize=${PANGEA_SANITIZE} -fno-omit-frame-pointer -O1 -g1
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  # Boost.Asio's fences, which the thread sanitizer does not see; it has locks beside them.
  if(PANGEA_SANITIZE STREQUAL "thread")
    add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
  endif()
  add_link_options(-fsanitize=${PANGEA_SANITIZE})
  if(PANGEA_SANITIZE MATCHES "fuzzer")  # a report must end the run, or nobody sees it
    add_compile_options(-fno-sanitize-recover=all -D_GLIBCXX_ASSERTIONS
      -fsanitize-ignorelist=${CMAKE_SOURCE_DIR}/tests/fuzz/sanitizer_ignored.txt)
  endif()
endif()

# All that people run, and all that `cmake --install` installs; no tests, no viewer's page.
add_custom_target(programs)

# The include path of one module alone: a folder in which only this module's is. So a library sees the
# headers of the modules whose libraries it names, and of those that these name, and no others: an
# include that goes round the layers does not compile.
function(pangea_include_root out)
  file(RELATIVE_PATH module ${CMAKE_SOURCE_DIR}/modules ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/.*" "" module ${module})
  if(module STREQUAL "..")  # tests, benches and examples have no headers for others
    set(${out} "" PARENT_SCOPE)
    return()
  endif()
  set(root ${CMAKE_BINARY_DIR}/include_roots/${module})
  file(MAKE_DIRECTORY ${root})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/modules/${module} ${root}/${module} SYMBOLIC)
  set(${out} ${root} PARENT_SCOPE)
endfunction()

# pangea_library(name [INTERNAL] [SOURCES ...] DEPENDS ...): a static library, or one of headers alone,
# included as "<module>/<header>.h"; installed as pangea::<name without pangea_>. INTERNAL: not
# installed (of tests and benches).
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

# A program's manual page, where help2man is at hand.
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

# pangea_program(name [INTERNAL] SOURCES ... DEPENDS ...): a binary, and a test that its --help works.
function(pangea_program name)
  if(EMSCRIPTEN)
    return()
  endif()
  cmake_parse_arguments(ARG "INTERNAL" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  pangea_include_root(root)
  target_include_directories(${name} PRIVATE ${root})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} CLI11::CLI11)
  # What takes time is in the libraries; CLI11 compiles a third faster so.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
  add_dependencies(programs ${name})
  if(NOT ARG_INTERNAL)
    install(TARGETS ${name} RUNTIME COMPONENT runtime)
    # Bash looks for a file of the program's name.
    install(FILES ${CMAKE_SOURCE_DIR}/scripts/completion/pangea.bash RENAME ${name} COMPONENT runtime
      DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
    pangea_manual_page(${name})
  endif()
  add_test(NAME ${name}.help COMMAND ${name} --help)
  set_tests_properties(${name}.help PROPERTIES LABELS unit)
endfunction()

# Where tests leave what they write: of this build tree, so that those of two trees do not meet.
set(test_files ${CMAKE_BINARY_DIR}/tmp)
file(MAKE_DIRECTORY ${test_files})

# pangea_test(name [SEPARATE] SOURCES ... DEPENDS ... [LABEL unit|system|slow] [TIMEOUT s]): one
# GoogleTest binary. SEPARATE: its sources use the same names, so that each is compiled by itself.
function(pangea_test name)
  if(EMSCRIPTEN)
    return()
  endif()
  cmake_parse_arguments(ARG "SEPARATE" "LABEL;TIMEOUT" "SOURCES;DEPENDS" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(PANGEA_SANITIZE)  # up to ten times slower
    math(EXPR ARG_TIMEOUT "10 * ${ARG_TIMEOUT}")
  endif()
  add_executable(${name} ${ARG_SOURCES})
  if(ARG_SEPARATE)
    set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  endif()
  # A test spends its time in the libraries; its own code is compiled a third faster so.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  pangea_include_root(root)
  target_include_directories(${name} PRIVATE ${root})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE PANGEA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    PANGEA_BINARY_DIR="${CMAKE_BINARY_DIR}")
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT}
    ENVIRONMENT TMPDIR=${test_files})
endfunction()
