// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace sinew::bindings {

namespace py = pybind11;
using namespace pybind11::literals;  // "name"_a for arguments

/// Text as a template argument.
template <std::size_t size>
struct Text {
    char characters[size]{};

    constexpr Text() = default;
    constexpr Text(const char (&text)[size]) { std::copy_n(text, size, characters); }
};

template <std::size_t m, std::size_t n>
constexpr Text<m + n - 1> operator+(const Text<m>& a, const Text<n>& b) {
    Text<m + n - 1> sum;
    std::copy_n(a.characters, m - 1, sum.characters);
    std::copy_n(b.characters, n, sum.characters + m - 1);
    return sum;
}

/// Any Python object. Signatures, and so the stub, say that it is a `type`; the functions check it.
template <Text type>
struct Typed : py::object {
    using py::object::object;
    Typed() = default;
    Typed(py::object value)
        : py::object(std::move(value)) {}  // implicit, as for arguments of pybind11's types
    static bool check_(const py::handle& /*value*/) { return true; }
};

using ArrayLike = Typed<"numpy.typing.ArrayLike">;
using OptionalArrayLike = Typed<"numpy.typing.ArrayLike | None">;
using Array = Typed<"numpy.typing.NDArray[typing.Any]">;
using Out = Typed<"numpy.typing.NDArray[numpy.float32] | None">;
using Index = Typed<"typing.SupportsIndex">;
using Threads = Typed<"typing.SupportsIndex | None">;
using Name = Typed<"str">;
using Number = Typed<"float">;
using Flag = Typed<"bool">;
using Mix = Typed<"tuple[str, numpy.typing.ArrayLike] | None">;
using VertexArrays = Typed<"collections.abc.Mapping[str, numpy.typing.ArrayLike | None] | None">;
using ParameterValues = Typed<"collections.abc.Mapping[str, float | bool | str] | None">;

/// A named tuple of sinew._types.
template <Text name>
using NamedTuple = Typed<Text("sinew._types.") + name + Text("[typing.Any]")>;

// What several classes say of themselves.
inline constexpr const char* kVertexCount = "Number of vertices.";
inline constexpr const char* kInfluenceCount = "Number of influences of positive weight.";
inline constexpr const char* kBoneCount =
    "How many bones a pose must have: one more than the highest that an influence or vertex data names.";

}  // namespace sinew::bindings

template <sinew::bindings::Text text>  // not `type`, which is a class of pybind11
struct pybind11::detail::handle_type_name<sinew::bindings::Typed<text>> {
    static constexpr auto name = const_name(text.characters);
};
