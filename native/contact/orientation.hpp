// Signs of determinants of points, exact for any doubles (short of overflow and underflow).
#pragma once

#include "contact/vec3.hpp"

namespace qlb {

// +1, 0 or -1: the sign of det(a - d, b - d, c - d).
int orientation(Vec3 a, Vec3 b, Vec3 c, Vec3 d);

// The same in the plane of the coordinates other than `axis` (0, 1, 2): the sign of det(a - c, b - c).
int orientation_in_plane(int axis, Vec3 a, Vec3 b, Vec3 c);

}  // namespace qlb
