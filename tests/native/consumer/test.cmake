# Installs the library, builds the programs of this folder against it and runs them.
#   cmake -DSOURCE=... -DBUILD=... [-DGLM=...] -P test.cmake
# GLM  a folder with GLM's headers: installs as on a system without GLM, with these headers instead of fetched ones
set(folder "${BUILD}/consumer")
set(build "${BUILD}")
set(without_glm "")

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

if(GLM)
  set(folder "${BUILD}/consumer-without-glm")
  set(build "${folder}/library")
  set(without_glm -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON)
endif()
file(REMOVE_RECURSE "${folder}")
if(GLM)
  file(COPY "${GLM}/glm" DESTINATION "${folder}/fetched")
  run(${CMAKE_COMMAND} -S "${SOURCE}" -B "${build}" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSINEW_BUILD_TESTS=OFF
    ${without_glm} "-DFETCHCONTENT_SOURCE_DIR_GLM=${folder}/fetched" "-DCMAKE_CXX_FLAGS=${FLAGS}")
  # One file shows that the library compiles with these headers. The library itself is that of BUILD.
  if(WIN32)
    set(object obj)
  else()
    set(object o)
  endif()
  run(${CMAKE_COMMAND} --build "${build}"
    --target "native/sinew/CMakeFiles/sinew.dir/deformer.cpp.${object}")
  file(GLOB built "${BUILD}/native/sinew/*sinew.*")
  file(COPY ${built} DESTINATION "${build}/native/sinew")
endif()

file(READ "${SOURCE}/docs/library.md" library)
if(NOT library MATCHES "```cpp\n([^`]+)```")
  message(FATAL_ERROR "docs/library.md has no C++ program")
endif()
file(WRITE "${folder}/build/library.cpp" "${CMAKE_MATCH_1}")
run(${CMAKE_COMMAND} --install "${build}" --prefix "${folder}/installed")

# Versions that are compatible for CMake must be compatible for the linker.
file(GLOB_RECURSE libraries "${folder}/installed/libsinew.*")
if(UNIX AND NOT APPLE AND NOT libraries MATCHES "libsinew\\.so\\.0\\.1;")
  message(FATAL_ERROR "no libsinew.so.0.1 among ${libraries}")
endif()
# Without GLM the same headers are installed: each alone is compiled once.
set(headers "${folder}/installed/include")
if(GLM)
  set(headers "")
endif()
run(${CMAKE_COMMAND} -S "${SOURCE}/tests/native/consumer" -B "${folder}/build" -G Ninja ${without_glm}
  "-DCMAKE_PREFIX_PATH=${folder}/installed" "-DSINEW_INCLUDE=${headers}"
  "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build "${folder}/build")
foreach(program library calls_plain calls_aligned)
  run("${folder}/build/${program}")
endforeach()
