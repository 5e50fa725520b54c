// SPDX-License-Identifier: GPL-3.0-or-later
// Which other projects are compiled into the library and this module, with versions from their headers. It is
// stored in the binary as text, so that the bill of materials (tools/sbom.py) is made from the binary itself, for
// any platform.
#include <pybind11/pybind11.h>

#include <glm/glm.hpp>

#ifdef SINEW_BINDINGS_WITH_EIGEN
#include <Eigen/Core>
#endif

#include <hwy/highway.h>

#define SINEW_AS_TEXT(value) #value
#define SINEW_VALUE_AS_TEXT(value) SINEW_AS_TEXT(value)
#define SINEW_VERSION_OF(major, minor, patch) \
    SINEW_VALUE_AS_TEXT(major) "." SINEW_VALUE_AS_TEXT(minor) "." SINEW_VALUE_AS_TEXT(patch)

namespace {

constexpr const char* kCompiledIn =
    "sinew-compiled-in{"
    // "GLM: version 0.9.9.8": the only macro that contains the full version in all releases.
    "GLM=" GLM_VERSION_MESSAGE ";Highway=" SINEW_VERSION_OF(HWY_MAJOR, HWY_MINOR, HWY_PATCH)
#ifdef SINEW_BINDINGS_WITH_EIGEN
        ";Eigen=" SINEW_VERSION_OF(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)
#endif
            ";pybind11=" SINEW_VERSION_OF(PYBIND11_VERSION_MAJOR, PYBIND11_VERSION_MINOR,
                                          PYBIND11_VERSION_PATCH)
#ifdef SINEW_STANDARD_LIBRARY_WITHIN
// Defined by tools/cross_build.py, which links the standard library statically.
#ifdef _LIBCPP_VERSION
                ";LLVM=" SINEW_VALUE_AS_TEXT(_LIBCPP_VERSION)
#endif
#ifdef __MINGW64_VERSION_STR
                    ";mingw-w64=" __MINGW64_VERSION_STR
#endif
#endif
                    "}";

}  // namespace

namespace sinew::bindings {

void bind_compiled_in(pybind11::module_& m) { m.attr("__compiled_in__") = kCompiledIn; }

}  // namespace sinew::bindings
