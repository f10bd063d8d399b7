# Rules of `cmake --install` for files that belong to no single target: headers, the CMake package,
# systemd units, session files. Each target has its own rules where it is defined.
#   --component runtime   programs, web pages, the types' jar, Python package, units, session files
#   --component dev       libraries, headers, lcmtypes, find_package(pangea)
include(CMakePackageConfigHelpers)

# Headers of tests and of their test worlds are not installed.
install(DIRECTORY ${CMAKE_SOURCE_DIR}/modules/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pangea
  COMPONENT dev FILES_MATCHING PATTERN "*.h"
  REGEX "/testing$|/page$|/mcap$|/test_[a-z_]*\\.h$|_test_world\\.h$" EXCLUDE)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/pangea)
set(generated_config ${CMAKE_BINARY_DIR}/pangeaConfig.cmake)
set(generated_version ${CMAKE_BINARY_DIR}/pangeaConfigVersion.cmake)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/pangeaConfig.cmake.in ${generated_config}
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${generated_version} COMPATIBILITY SameMinorVersion)
install(FILES ${generated_config} ${generated_version} ${CMAKE_CURRENT_LIST_DIR}/pangea_dependencies.cmake
  DESTINATION ${package_dir} COMPONENT dev)
install(EXPORT pangea FILE pangeaTargets.cmake NAMESPACE pangea:: DESTINATION ${package_dir} COMPONENT dev)

# systemd looks for all of these under /usr/lib, and for the units under /usr/local/lib as well.
set(packaging ${CMAKE_SOURCE_DIR}/packaging)
install(DIRECTORY ${packaging}/systemd/ DESTINATION lib/systemd/system COMPONENT runtime)
foreach(kind sysctl sysusers tmpfiles)
  install(FILES ${packaging}/${kind}.conf DESTINATION lib/${kind}.d RENAME pangea.conf COMPONENT runtime)
endforeach()
install(DIRECTORY ${CMAKE_SOURCE_DIR}/sessions DESTINATION ${CMAKE_INSTALL_DATADIR}/pangea COMPONENT runtime)
foreach(script pangea-nats-config pangea-spy)
  configure_file(${packaging}/${script} ${CMAKE_BINARY_DIR}/packaging/${script} @ONLY)
  install(PROGRAMS ${CMAKE_BINARY_DIR}/packaging/${script} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
endforeach()
# A captured session, for a first replay.
install(FILES ${CMAKE_SOURCE_DIR}/logs/two_walks/session.lcm DESTINATION ${CMAKE_INSTALL_DATADIR}/pangea/logs/two_walks
  COMPONENT runtime)
