# Each dependency from the system where it is installed, else fetched at a fixed version.
include(FetchContent)

find_package(glm QUIET)
if(NOT TARGET glm::glm)
  FetchContent_Declare(glm GIT_REPOSITORY https://github.com/g-truc/glm.git GIT_TAG 1.0.1)
  FetchContent_MakeAvailable(glm)
endif()

find_package(Threads REQUIRED)

if(SINEW_BUILD_TESTS)
  find_package(GTest QUIET)
  if(NOT TARGET GTest::gtest_main)
    FetchContent_Declare(googletest GIT_REPOSITORY https://github.com/google/googletest.git GIT_TAG v1.15.2)
    FetchContent_MakeAvailable(googletest)
  endif()
endif()
