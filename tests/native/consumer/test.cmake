# Installs the library from BUILD, builds the README's C++ program against it and runs it.
#   cmake -DSOURCE=... -DBUILD=... -P test.cmake
set(folder "${BUILD}/consumer")
file(REMOVE_RECURSE "${folder}")

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(READ "${SOURCE}/README.md" readme)
if(NOT readme MATCHES "```cpp\n([^`]+)```")
  message(FATAL_ERROR "README.md has no C++ program")
endif()
file(WRITE "${folder}/build/readme.cpp" "${CMAKE_MATCH_1}")
run(${CMAKE_COMMAND} --install "${BUILD}" --prefix "${folder}/installed")
run(${CMAKE_COMMAND} -S "${SOURCE}/tests/native/consumer" -B "${folder}/build" -G Ninja
  "-DCMAKE_PREFIX_PATH=${folder}/installed" "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build "${folder}/build")
run("${folder}/build/consumer")
