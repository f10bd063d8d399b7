# The agent beside the page. Where it is not built the page says so when it is started.
foreach(file pangea_agent.mjs pangea_agent.wasm)
  if(EXISTS ${FROM}/${file})
    file(COPY ${FROM}/${file} DESTINATION ${TO})
  endif()
endforeach()
