// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"
#include "module.h"
#include "sinew/transform/rigid_distance.h"
#include "sinew/transform/split_scale.h"

namespace sinew::bindings {
namespace {

// What every representation has. Described in the typed modules sinew.affine, .quat_vec and .dual_quat.
template <template <class> class X>
void bind_representation(py::module_& m) {
    def<Vec3, Scalar>(m, "from_axis_angle", {"axis", "angle"},
                      [](const auto& axis, auto angle) { return from_axis_angle<X>(axis, angle); });
    def<Mat3>(m, "from_rotation_matrix", {"rotation"},
              [](const auto& rotation) { return from_rotation_matrix<X>(rotation); });
    def<Vec3>(m, "from_translation", {"translation"},
              [](const auto& translation) { return from_translation<X>(translation); });
    def<Vec3, Vec3, Scalar, Scalar>(
        m, "from_screw", {"axis", "moment", "angle", "translation"},
        []<class T>(const Vec3<T>& axis, const Vec3<T>& moment, T angle, T translation) {
            return to<X>(Screw<T>{axis, moment, angle, translation});
        });
    def<Vec3, Vec3, Scalar, Scalar>(m, "from_screw_about", {"axis", "point", "angle", "translation"},
                                    [](const auto& axis, const auto& point, auto angle, auto translation) {
                                        return to<X>(screw_about(axis, point, angle, translation));
                                    });
    def<X>(m, "to_screw", {"a"}, [](const auto& a) {
        const auto screw = to_screw(a);
        return std::tuple(screw.axis, screw.moment, screw.angle, screw.translation, screw.pitch());
    });
    def<Twist>(m, "from_twist", {"twist"}, [](const auto& twist) { return to<X>(twist); });
    def<X>(m, "to_twist", {"a"}, [](const auto& a) { return to_twist(a); });
    def<X>(m, "to_affine", {"a"}, [](const auto& a) { return to<Affine>(a); });
    def<X>(m, "to_quat_vec", {"a"}, [](const auto& a) { return to<QuatVec>(a); });
    def<X>(m, "to_dual_quat", {"a"}, [](const auto& a) { return to<DualQuat>(a); });
    def<X, X>(m, "compose", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; });
    def<X>(m, "inverse", {"a"}, [](const auto& a) {
        if constexpr (requires { a.linear; }) {
            if (glm::determinant(a.linear) == 0) fail("a", "an invertible transform", "one of determinant 0");
        }
        return inverse(a);
    });
    def<X>(m, "normalized", {"a"}, [](const auto& a) { return normalized(a); });
    def<X, Vec3>(m, "transform_point", {"a", "points"},
                 [](const auto& a, const auto& point) { return transform_point(a, point); });
    def<X, Vec3>(m, "transform_vector", {"a", "vectors"},
                 [](const auto& a, const auto& vector) { return transform_vector(a, vector); });
    def<X, Vec3>(m, "transform_normal", {"a", "normals"},
                 [](const auto& a, const auto& normal) { return transform_normal(a, normal); });
    def<X, X>(m, "rigid_distance", {"a", "b"}, [](const auto& a, const auto& b) {
        const auto apart = rigid_distance(a, b);
        return std::tuple(apart.angle, apart.translation);
    });
}

void bind_dual_quaternions(py::module_& m) {
    def<DualQuat>(m, "conjugate", {"a"}, [](const auto& a) { return conjugate(a); });
    def<DualQuat>(m, "dual_conjugate", {"a"}, [](const auto& a) { return dual_conjugate(a); });
    def<DualQuat>(m, "combined_conjugate", {"a"}, [](const auto& a) { return combined_conjugate(a); });
    def<DualQuat>(m, "norm", {"a"}, [](const auto& a) { return norm(a); });
    def<DualQuat>(m, "log", {"a"}, [](const auto& a) { return log(a); });
    def<DualQuat>(m, "exp", {"a"}, [](const auto& a) { return exp(a); });
    def<DualQuat, Scalar>(m, "power", {"a", "exponent"},
                          [](const auto& a, auto exponent) { return power(a, exponent); });
}

}  // namespace

void bind_transforms(py::module_& m) {
    auto affine = m.def_submodule("affine");
    auto quat_vec = m.def_submodule("quat_vec");
    auto dual_quat = m.def_submodule("dual_quat");
    bind_representation<Affine>(affine);
    bind_representation<QuatVec>(quat_vec);
    bind_representation<DualQuat>(dual_quat);
    def<Affine, Affine>(affine, "split_scale", {"posed_from_rest", "rest_bone"},
                        [](const auto& posed_from_rest, const auto& rest_bone) {
                            const auto split = split_scale(posed_from_rest, rest_bone);
                            return std::tuple(split.rigid, split.scale, split.has_scale);
                        });
    bind_dual_quaternions(dual_quat);
}

}  // namespace sinew::bindings
