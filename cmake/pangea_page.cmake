# Web pages in TypeScript, which Vite builds. They need npm.
find_program(NPM npm)

# pangea_page(name FOLDER page OUT dir [SHARED files]) defines the target `name`, which builds the
# page in the folder into dir, with the packages of its package-lock.json. SHARED lists source files
# outside of its folder. `programs` does not build pages: the script that shows a page builds it.
function(pangea_page name)
  cmake_parse_arguments(ARG "" "FOLDER;OUT" "SHARED" ${ARGN})
  set(page ${ARG_FOLDER})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${page}/src/* ${page}/public/*)
  set(npm_stamp ${CMAKE_CURRENT_BINARY_DIR}/npm_ci.stamp)
  add_custom_command(OUTPUT ${npm_stamp}
    COMMAND ${NPM} ci --loglevel error --no-audit --no-fund --prefer-offline
    COMMAND ${CMAKE_COMMAND} -E touch ${npm_stamp}
    DEPENDS ${page}/package-lock.json
    WORKING_DIRECTORY ${page}
    COMMENT "Fetching the packages of ${name}")
  add_custom_command(OUTPUT ${ARG_OUT}/index.html
    COMMAND ${CMAKE_COMMAND} -E env PANGEA_PAGE_OUT=${ARG_OUT} ${NPM} run --silent build
    DEPENDS ${npm_stamp} ${sources} ${ARG_SHARED} ${page}/index.html ${page}/package.json
      ${page}/tsconfig.json ${page}/vite.config.js
    WORKING_DIRECTORY ${page}
    COMMENT "Building ${name}")
  add_custom_target(${name} ALL DEPENDS ${ARG_OUT}/index.html)
endfunction()
