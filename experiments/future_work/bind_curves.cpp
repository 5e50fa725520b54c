// SPDX-License-Identifier: GPL-3.0-or-later
#include "future_work/curves/hermite.h"
#include "future_work/module.h"
#include "interpolations.h"

namespace sinew::bindings {
namespace {

template <class T, class Key, class Tangent>
py::object hermite_items(const std::array<py::object, 4>& values) {
    const auto keys = checked_input<T, Key>(values[0], "keys");
    const auto input = checked_input<T, Tangent>(values[1], "tangents");
    const std::vector<Tangent> tangents = items_of<Tangent>(input);
    if (keys.lead.size() == 1 && input.lead != keys.lead) {
        fail("tangents", shape_text({keys.lead[0]}) + " of them, one for each key", describe(values[1]));
    }
    return along_keys<T, Key>(values[0], values[2], values[3], [&](auto items, auto times, T time) {
        const auto found = hermite<T>(items, std::span<const Tangent>(tangents), times, time);
        if constexpr (std::is_same_v<Key, Vec3<T>>) {
            return sinew::Blended<Key>{found, is_finite(found)};
        } else {
            return found;
        }
    });
}

NamedTuple<"Blended"> hermite_spline(const ArrayLike& keys, const ArrayLike& tangents, const ArrayLike& times,
                                     const ArrayLike& at) {
    const auto values = promoted<4>({"keys", "tangents", "times", "at"}, {keys, tangents, times, at});
    const bool has_points = is_of_points(values[0]);
    return with_element(values[0], "keys", "[n, 3] or [n, 8]", [&]<class T>(T) {
        return has_points ? hermite_items<T, Vec3<T>, Vec3<T>>(values)
                          : hermite_items<T, DualQuat<T>, Twist<T>>(values);
    });
}

}  // namespace

void bind_curves(py::module_& m) {
    m.def_submodule("curves").def(
        "hermite", &hermite_spline, "keys"_a, "tangents"_a, "times"_a, "at"_a,
        R"(The cubic Hermite spline through keys with arbitrary tangents (Smith 2013, section 2.3.2).

keys: [n, 3], points, or [n, 8], rigid transforms.
tangents: for a unit of time. Of points [n, 3]. Of transforms [n, 6], twists in each key's own axes: after a
    short time h the curve is compose(key, from_twist(h * tangent)).

For transforms it is a Bezier curve whose chords are screws (Shoemake 1985, for quaternions): rigid throughout.
Not defined where "sclerp" is not defined between two of its control poses.)");
}

}  // namespace sinew::bindings
