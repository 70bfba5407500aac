// The Hessian of one contact's energy, 12 x 12 over its four nodes.
#pragma once

#include <vector>

#include "contact/potentials.hpp"
#include "contact/separation.hpp"

namespace qlb {

// stiffness n n^T at node 0, else zero. block: (12, 12).
void plane_hessian(const std::array<double, 3>& normal, double stiffness, double* block);

// Of m(c) f(d): m (f'' g g^T + f' d2d) + f' (dm g^T + g dm^T) + f d2m, with g = dd/dx. f: the potential in d.
// project: to the nearest positive semidefinite matrix.
void pair_hessian(const std::array<Vec3, 4>& x, const Separation& separation, Derivatives f, const Mollifier& mollifier,
                  bool project, double* block);

// The same without m f'' g g^T, as a sum of s a a^T over its eigenvectors a with eigenvalues s above `threshold`, which
// are appended to `vectors` (12 entries each) and `stiffness`; returns how many.
int pair_bending(const std::array<Vec3, 4>& x, const Separation& separation, Derivatives f, const Mollifier& mollifier,
                 double threshold, std::vector<std::array<double, 12>>& vectors, std::vector<double>& stiffness);

}  // namespace qlb
