#include "contact/contact_hessian.hpp"

#include <algorithm>

#include "contact/jacobi.hpp"
#include "contact/tangents.hpp"

namespace qlb {
namespace {

using Vec12 = std::array<double, 12>;

Vec12 outer(const std::array<double, 4>& gamma, Vec3 a) {
  Vec12 out{};
  for (int i = 0; i < 4; ++i) add3(gamma[i] * a, &out[3 * i]);
  return out;
}

// block += s a a^T
void add_square(double s, const Vec12& a, double* block) {
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) block[12 * i + j] += s * a[i] * a[j];
}

// block += s (a b^T + b a^T)
void add_product(double s, const Vec12& a, const Vec12& b, double* block) {
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) block[12 * i + j] += s * (a[i] * b[j] + b[i] * a[j]);
}

// The vectors w_b = dw/db = sum_i slope_bi x_i along which the closest points slide, and their duals v_b.v_c = A^-1_bc,
// A_bc = w_b.w_c. In cross products, as A is nearly singular for nearly parallel edges.
struct Sliding {
  std::array<Vec3, 2> w{}, dual{};

  Sliding(const std::array<Vec3, 4>& x, const ClosestPoints& c) {
    for (int b = 0; b < c.parameters; ++b)
      for (int i = 0; i < 4; ++i) w[b] = w[b] + c.slope[b][i] * x[i];
    if (c.parameters == 1) dual[0] = (1.0 / dot(w[0], w[0])) * w[0];
    if (c.parameters != 2) return;
    const Vec3 k = cross(w[0], w[1]);
    const double inverse = 1.0 / dot(k, k);
    dual = {inverse * cross(w[1], k), inverse * cross(k, w[0])};
  }
};

// block += s d2d. With F = |w|^2, H(d^2) = F_xx - F_xb F_bb^-1 F_bx = 2 (g g^T + d d2d), and F_xb = 2 (slope_b (x) w +
// gamma (x) w_b), what is left of it is, at nodes i and j,
//   gamma_i gamma_j / d R - d y_i.y_j n n^T - gamma_j n y_i^T - gamma_i y_j n^T,  y_i = sum_b slope_bi v_b,
// R projecting on what is normal to n and to all w_b.
void add_distance_hessian(double s, const std::array<Vec3, 4>& x, const Separation& p, double* block) {
  const ClosestPoints& c = p.closest;
  const Sliding sliding(x, c);
  const double turn = p.distance != 0.0 ? s / p.distance : 0.0;
  if (c.parameters == 0)
    for (const Vec3 tangent : tangents(p.normal)) add_square(turn, outer(c.gamma, tangent), block);
  if (c.parameters == 1) add_square(turn, outer(c.gamma, unit(cross(p.normal, sliding.w[0]))), block);

  // -d y_i.y_j n n^T - ... = -sum_b [d A^-1_bc (slope_b n)(slope_c n)^T + (slope_b n)(gamma v_b)^T + transpose]
  std::array<Vec12, 2> slid;
  for (int b = 0; b < c.parameters; ++b) {
    slid[b] = outer(c.slope[b], p.normal);
    add_square(-s * p.distance * dot(sliding.dual[b], sliding.dual[b]), slid[b], block);
    add_product(-s, slid[b], outer(c.gamma, sliding.dual[b]), block);
  }
  if (c.parameters == 2) add_product(-s * p.distance * dot(sliding.dual[0], sliding.dual[1]), slid[0], slid[1], block);
}

// dc/dx
Vec12 cross_gradient(const Mollifier& mollifier) {
  Vec12 out{};
  for (int i = 0; i < 4; ++i) add3((i % 2 == 0 ? -1.0 : 1.0) * mollifier.c_slope[i / 2], &out[3 * i]);
  return out;
}

// block += s d2c, c = |e1|^2 |e2|^2 - (e1.e2)^2: d2c/de1de1 = 2 (|e2|^2 1 - e2 e2^T), d2c/de1de2 = 4 e1 e2^T -
// 2 e2 e1^T - 2 e1.e2 1.
void add_cross_hessian(double s, const Mollifier& mollifier, double* block) {
  const double e[2][3] = {{mollifier.e1.x, mollifier.e1.y, mollifier.e1.z},
                          {mollifier.e2.x, mollifier.e2.y, mollifier.e2.z}};
  double products[2][2] = {};
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b)
      for (int k = 0; k < 3; ++k) products[a][b] += e[a][k] * e[b][k];
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) {
      const int a = i / 6, b = j / 6, k = i % 3, l = j % 3, same = k == l;  // edges a and b, components k and l
      const double d2c = a == b ? 2.0 * (products[1 - a][1 - a] * same - e[1 - a][k] * e[1 - a][l])
                                : 4.0 * e[a][k] * e[b][l] - 2.0 * e[b][k] * e[a][l] - 2.0 * products[0][1] * same;
      const double sign = (i / 3) % 2 == (j / 3) % 2 ? 1.0 : -1.0;
      block[12 * i + j] += s * sign * d2c;
    }
}

// block += f d2m + f' (dm g^T + g dm^T)
void add_mollifier(const Mollifier& mollifier, Derivatives f, const Vec12& g, double* block) {
  const Vec12 dc = cross_gradient(mollifier);
  add_product(f.first * mollifier.m.first, dc, g, block);
  add_square(f.value * mollifier.m.second, dc, block);
  add_cross_hessian(f.value * mollifier.m.first, mollifier, block);
}

// Calls f(value, vector) for each eigenpair of a matrix that vanishes across the orthonormal `basis` (rows may be
// zero).
template <int n, class F>
void for_each_eigenpair(const std::array<Vec12, n>& basis, const double* block, const F& f) {
  Square<n> A, vectors;
  for (int q = 0; q < n; ++q) {
    Vec12 product{};
    for (int i = 0; i < 12; ++i)
      for (int j = 0; j < 12; ++j) product[j] += basis[q][i] * block[12 * i + j];
    for (int p = 0; p < n; ++p) {
      A[p][q] = 0.0;
      for (int j = 0; j < 12; ++j) A[p][q] += basis[p][j] * product[j];
    }
  }
  jacobi_eigen<n>(A, vectors);
  for (int k = 0; k < n; ++k) {
    Vec12 a{};
    for (int p = 0; p < n; ++p)
      for (int i = 0; i < 12; ++i) a[i] += vectors[k][p] * basis[p][i];
    f(A[k][k], a);
  }
}

// Takes the negative part off.
template <int n>
void project_on(const std::array<Vec12, n>& basis, double* block) {
  for_each_eigenpair<n>(basis, block, [&](double value, const Vec12& a) {
    if (value < 0.0) add_square(-value, a, block);
  });
}

// Without a mollifier all columns lie in {gamma, slope_b} (x) n and gamma (x) tangents: five at most.
std::array<Vec12, 5> distance_basis(const Separation& p) {
  const ClosestPoints& c = p.closest;
  std::array<std::array<double, 4>, 3> q{c.gamma, c.slope[0], c.slope[1]};
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < a; ++b) {
      double along = 0.0;
      for (int i = 0; i < 4; ++i) along += q[a][i] * q[b][i];
      for (int i = 0; i < 4; ++i) q[a][i] -= along * q[b][i];
    }
    double square = 0.0;
    for (int i = 0; i < 4; ++i) square += q[a][i] * q[a][i];
    const double inverse = square > 0.0 ? 1.0 / std::sqrt(square) : 0.0;
    for (int i = 0; i < 4; ++i) q[a][i] *= inverse;
  }
  const auto [t1, t2] = tangents(p.normal);
  return {outer(q[0], p.normal), outer(q[1], p.normal), outer(q[2], p.normal), outer(q[0], t1), outer(q[0], t2)};
}

// All that does not change when the four nodes move together.
std::array<Vec12, 9> relative_basis() {
  const double h = 0.5;
  const std::array<std::array<double, 4>, 3> q{{{h, -h, h, -h}, {h, h, -h, -h}, {h, -h, -h, h}}};
  const Vec3 axes[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  std::array<Vec12, 9> basis;
  for (int k = 0; k < 9; ++k) basis[k] = outer(q[k / 3], axes[k % 3]);
  return basis;
}

}  // namespace

void plane_hessian(const std::array<double, 3>& normal, double stiffness, double* block) {
  std::fill_n(block, 144, 0.0);
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) block[12 * k + l] = stiffness * normal[k] * normal[l];
}

void pair_hessian(const std::array<Vec3, 4>& x, const Separation& separation, Derivatives f, const Mollifier& mollifier,
                  bool project, double* block) {
  std::fill_n(block, 144, 0.0);
  if (!std::isfinite(f.value) || !(f.second > 0.0)) return;
  const Vec12 g = outer(separation.closest.gamma, separation.normal);
  add_square(mollifier.m.value * f.second, g, block);
  add_distance_hessian(mollifier.m.value * f.first, x, separation, block);
  if (mollifier.active()) add_mollifier(mollifier, f, g, block);
  if (!project) return;
  if (mollifier.active())
    project_on<9>(relative_basis(), block);
  else
    project_on<5>(distance_basis(separation), block);
}

int pair_bending(const std::array<Vec3, 4>& x, const Separation& separation, Derivatives f, const Mollifier& mollifier,
                 double threshold, std::vector<Vec12>& vectors, std::vector<double>& stiffness) {
  if (!std::isfinite(f.value) || !(f.second > 0.0)) return 0;
  const Sliding sliding(x, separation.closest);
  const double steepest = std::max(norm(sliding.dual[0]), norm(sliding.dual[1]));
  if (!mollifier.active() && 4.0 * std::abs(f.first) * steepest < threshold) return 0;
  double block[144] = {};
  add_distance_hessian(mollifier.m.value * f.first, x, separation, block);
  if (mollifier.active()) add_mollifier(mollifier, f, outer(separation.closest.gamma, separation.normal), block);
  int count = 0;
  const auto keep = [&](double value, const Vec12& a) {
    if (!(value > threshold)) return;
    vectors.push_back(a);
    stiffness.push_back(value);
    ++count;
  };
  if (mollifier.active())
    for_each_eigenpair<9>(relative_basis(), block, keep);
  else
    for_each_eigenpair<5>(distance_basis(separation), block, keep);
  return count;
}

}  // namespace qlb
