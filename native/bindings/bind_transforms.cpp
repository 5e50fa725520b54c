// SPDX-License-Identifier: GPL-3.0-or-later
#include "broadcast.h"
#include "module.h"
#include "sinew/interpolate/spherical.h"
#include "sinew/transform/rigid_distance.h"
#include "sinew/transform/split_scale.h"

namespace sinew::bindings {
namespace {

// Raises ValueError if `a` is a matrix that scales, shears or mirrors, which no quaternion can represent.
template <class X>
void check_rigid(const X& a, const char* argument) {
    if constexpr (requires { a.linear; }) {
        if (!is_rigid(a))
            fail(argument, "rigid transforms, as normalized() makes them", "one that is not rigid");
    }
}

// The functions of every representation. Documented in the typed modules sinew.affine, .quat_vec and .dual_quat.
template <template <class> class X>
void bind_representation(py::module_& m) {
    def<Vec3, Scalar>(m, "from_axis_angle", {"axis", "angle"},
                      [](const auto& axis, auto angle) { return from_axis_angle<X>(axis, angle); });
    def<Mat3>(m, "from_rotation_matrix", {"rotation"}, []<class T>(const Mat3<T>& rotation) {
        if constexpr (!std::is_same_v<X<T>, Affine<T>>) {
            check_rigid(Affine<T>{rotation, Vec3<T>(T(0))}, "rotation");
        }
        return from_rotation_matrix<X>(rotation);
    });
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
        check_rigid(a, "a");
        const auto screw = to_screw(a);
        return std::tuple(screw.axis, screw.moment, screw.angle, screw.translation, screw.pitch());
    });
    def<Twist>(m, "from_twist", {"twist"}, [](const auto& twist) { return to<X>(twist); });
    def<X>(m, "to_twist", {"a"}, [](const auto& a) {
        check_rigid(a, "a");
        return to_twist(a);
    });
    def<X>(m, "to_affine", {"a"}, [](const auto& a) { return to<Affine>(a); });
    def<X>(m, "to_quat_vec", {"a"}, [](const auto& a) {
        check_rigid(a, "a");
        return to<QuatVec>(a);
    });
    def<X>(m, "to_dual_quat", {"a"}, [](const auto& a) {
        check_rigid(a, "a");
        return to<DualQuat>(a);
    });
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
        check_rigid(a, "a");
        check_rigid(b, "b");
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

void bind_dual_numbers(py::module_& m) {
    def<Dual, Dual>(m, "multiply", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; });
    def<Dual, Dual>(m, "divide", {"a", "b"}, [](const auto& a, const auto& b) {
        if (b.real == 0) fail("b", "dual numbers whose real part is not 0", "one of real part 0");
        return a / b;
    });
    def<Dual>(m, "conjugate", {"a"}, [](const auto& a) { return conjugate(a); });
    def<Dual>(m, "sin", {"a"}, [](const auto& a) { return sin(a); });
    def<Dual>(m, "cos", {"a"}, [](const auto& a) { return cos(a); });
    def<Dual>(m, "exp", {"a"}, [](const auto& a) { return exp(a); });
    const auto check_positive = [](const auto& a) {
        if (!(a.real > 0)) fail("a", "dual numbers whose real part is above 0", "one that is not");
    };
    def<Dual>(m, "sqrt", {"a"}, [check_positive](const auto& a) {
        check_positive(a);
        return sqrt(a);
    });
    def<Dual>(m, "log", {"a"}, [check_positive](const auto& a) {
        check_positive(a);
        return log(a);
    });
}

void bind_quaternions(py::module_& m) {
    def<Vec3, Scalar>(m, "from_axis_angle", {"axis", "angle"},
                      [](const auto& axis, auto angle) { return quat_from_axis_angle(axis, angle); });
    def<Vec3>(m, "from_rotation_vector", {"vector"},
              [](const auto& vector) { return quat_from_rotation_vector(vector); });
    def<Quat>(m, "to_rotation_vector", {"q"}, [](const auto& q) { return rotation_vector(q); });
    def<Mat3>(m, "from_rotation_matrix", {"rotation"}, []<class T>(const Mat3<T>& rotation) {
        check_rigid(Affine<T>{rotation, Vec3<T>(T(0))}, "rotation");
        return to_quat(rotation);
    });
    def<Quat>(m, "to_rotation_matrix", {"q"}, [](const auto& q) { return to_mat3(q); });
    def<Quat, Quat>(m, "compose", {"a", "b"}, [](const auto& a, const auto& b) { return a * b; });
    def<Quat>(m, "conjugate", {"q"}, [](const auto& q) { return glm::conjugate(q); });
    def<Quat>(m, "norm", {"q"}, []<class T>(const Quat<T>& q) { return norm(DualQuat<T>{q, q}).real; });
    def<Quat>(m, "normalized", {"q"}, []<class T>(const Quat<T>& q) {
        return normalized(QuatVec<T>{q, Vec3<T>(T(0))}).rotation;
    });
    def<Quat, Vec3>(m, "rotate", {"q", "vectors"}, [](const auto& q, const auto& v) { return rotate(q, v); });
    def<Quat, Quat>(m, "angle_between", {"a", "b"},
                    [](const auto& a, const auto& b) { return angle_between(a, b); });
    def<Quat, Quat, Scalar>(m, "slerp", {"a", "b", "t"},
                            [](const auto& a, const auto& b, auto t) { return slerp(a, aligned(b, a), t); });
    def<Quat>(m, "to_three_numbers", {"q"}, [](const auto& q) { return three_numbers(q); });
    def<Vec3>(m, "from_three_numbers", {"numbers"},
              [](const auto& numbers) { return from_three_numbers(numbers); });
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
    auto dual = m.def_submodule("dual");
    bind_dual_numbers(dual);
    auto quat = m.def_submodule("quat");
    bind_quaternions(quat);
}

}  // namespace sinew::bindings
