# Each dependency from the system where it is installed, else fetched at a fixed version.
include(FetchContent)

# GLM's headers are part of Sinew's own. Where they are fetched, they are installed with it (SINEW_FETCHED_GLM is
# their folder): a target of theirs could not be exported, and a program would look for a GLM that is not there.
find_package(glm QUIET)
if(NOT TARGET glm::glm)
  FetchContent_Declare(glm GIT_REPOSITORY https://github.com/g-truc/glm.git GIT_TAG 1.0.1 SOURCE_SUBDIR none)
  FetchContent_MakeAvailable(glm)
  set(SINEW_FETCHED_GLM "${glm_SOURCE_DIR}")
  add_library(sinew_fetched_glm INTERFACE)
  target_include_directories(sinew_fetched_glm SYSTEM INTERFACE "${SINEW_FETCHED_GLM}")
  add_library(glm::glm ALIAS sinew_fetched_glm)
endif()

# Only Highway's headers. Debian has its library as a shared one, which a wheel would then need on the user's machine;
# targets.cpp chooses the instruction set instead.
add_library(hwy_headers INTERFACE)
find_path(HWY_INCLUDE_DIR hwy/foreach_target.h)
if(NOT HWY_INCLUDE_DIR)
  FetchContent_Declare(highway GIT_REPOSITORY https://github.com/google/highway.git GIT_TAG 1.2.0
    SOURCE_SUBDIR none)
  FetchContent_MakeAvailable(highway)
  set(HWY_INCLUDE_DIR "${highway_SOURCE_DIR}")
endif()
target_include_directories(hwy_headers SYSTEM INTERFACE "${HWY_INCLUDE_DIR}")
# Newer ones have several instruction sets for 64-bit ARM (targets.h), told apart here, as none of its headers may be
# included before the choice.
file(STRINGS "${HWY_INCLUDE_DIR}/hwy/detect_targets.h" several_neon REGEX "define HWY_NEON_WITHOUT_AES")
if(several_neon)
  target_compile_definitions(hwy_headers INTERFACE SINEW_HWY_HAS_NEON_WITHOUT_AES)
endif()

find_package(Threads REQUIRED)

if(SINEW_BUILD_TESTS)
  find_package(GTest QUIET)
  if(NOT TARGET GTest::gtest_main)
    FetchContent_Declare(googletest GIT_REPOSITORY https://github.com/google/googletest.git GIT_TAG v1.15.2)
    FetchContent_MakeAvailable(googletest)
  endif()
endif()

if(SINEW_BUILD_BENCH OR SINEW_BUILD_EXPERIMENTS)
  find_package(benchmark QUIET)
  if(NOT TARGET benchmark::benchmark)
    set(BENCHMARK_ENABLE_TESTING OFF)
    FetchContent_Declare(benchmark GIT_REPOSITORY https://github.com/google/benchmark.git GIT_TAG v1.9.0)
    FetchContent_MakeAvailable(benchmark)
  endif()
endif()

if(SINEW_WITH_DDM OR SINEW_BUILD_EXPERIMENTS OR SINEW_BUILD_BENCH)
  find_package(Eigen3 QUIET NO_MODULE)
  if(NOT TARGET Eigen3::Eigen)
    FetchContent_Declare(eigen GIT_REPOSITORY https://gitlab.com/libeigen/eigen.git GIT_TAG 3.4.0
      SOURCE_SUBDIR none)
    FetchContent_MakeAvailable(eigen)
    add_library(Eigen3::Eigen INTERFACE IMPORTED)
    target_include_directories(Eigen3::Eigen INTERFACE "${eigen_SOURCE_DIR}")
  endif()
endif()
