# Web pages in TypeScript, which Vite builds. They need npm; their tests need Node and Chromium.
find_program(NPM npm)
find_program(NODE node)
find_program(CHROMIUM chromium)

# pangea_npm_ci(stamp FOLDER dir) fetches the packages of the folder's package-lock.json, and sets
# `stamp` to the file on which their users depend.
function(pangea_npm_ci stamp)
  cmake_parse_arguments(ARG "" "FOLDER" "" ${ARGN})
  set(file ${CMAKE_CURRENT_BINARY_DIR}/npm_ci.stamp)
  add_custom_command(OUTPUT ${file}
    COMMAND ${NPM} ci --loglevel error --no-audit --no-fund --prefer-offline
    COMMAND ${CMAKE_COMMAND} -E touch ${file}
    DEPENDS ${ARG_FOLDER}/package-lock.json WORKING_DIRECTORY ${ARG_FOLDER}
    COMMENT "Fetching the npm packages of ${ARG_FOLDER}")
  set(${stamp} ${file} PARENT_SCOPE)
endfunction()

# pangea_page(name FOLDER page OUT dir [SHARED files]) defines the target `name`, which builds the
# page in the folder into dir, with the packages of its package-lock.json. SHARED lists source files
# outside of its folder. `programs` does not build pages: the script that shows a page builds it.
function(pangea_page name)
  cmake_parse_arguments(ARG "" "FOLDER;OUT" "SHARED" ${ARGN})
  set(page ${ARG_FOLDER})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${page}/src/* ${page}/public/*)
  pangea_npm_ci(npm_stamp FOLDER ${page})
  add_custom_command(OUTPUT ${ARG_OUT}/index.html
    COMMAND ${CMAKE_COMMAND} -E env PANGEA_PAGE_OUT=${ARG_OUT} ${NPM} run --silent build
    DEPENDS ${npm_stamp} ${sources} ${ARG_SHARED} ${page}/index.html ${page}/package.json
      ${page}/tsconfig.json ${page}/vite.config.js
    WORKING_DIRECTORY ${page}
    COMMENT "Building ${name}")
  add_custom_target(${name} ALL DEPENDS ${ARG_OUT}/index.html)
endfunction()
