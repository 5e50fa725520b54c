// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstring>

#include "arrays.h"
#include "gil.h"

namespace sinew::bindings {

/// Calls apply(points) for a copy of `given` in `out`, or in a new array if that is None, and returns the array.
template <class Stage, class Apply>
py::array_t<float> applied(const Timed<Stage>& stage, const py::array_t<float>& given, const py::object& out,
                           const Apply& apply) {
    py::array_t<float> result = checked_out(out, stage.vertex_count());
    const auto to = as_points_to_write(result);
    stage.call([&] {
        const auto from = as_points(given);
        if (from.data() != to.data()) std::memmove(to.data(), from.data(), from.size_bytes());
        return apply(to);
    });
    return result;
}

template <class Stage>
void set_rest_points(Timed<Stage>& stage, const ArrayLike& rest_points,
                     const OptionalArrayLike& bones_from_model) {
    const auto points = checked_points(rest_points, "rest_points");
    const Affine<float> space = checked_affine(bones_from_model, "bones_from_model");
    // May have to wait for another thread that applies it.
    Status status{};
    without_gil([&] { status = stage.set_rest_points(as_points(points), space); });
    check_rest_points(status, points, stage.vertex_count(), space);
}

}  // namespace sinew::bindings
