// Whether a segment meets a triangle, decided exactly: touching counts, and either may be degenerate.
#pragma once

#include "contact/vec3.hpp"

namespace qlb {

bool segment_meets_triangle(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c);

}  // namespace qlb
