// A floating-point filter and, where it cannot tell, sums of doubles that together hold the exact value: expansions
// (Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates").
#include "contact/orientation.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace qlb {
namespace {

// Rounded value first, then its error: the two add up to the exact result.
std::pair<double, double> two_sum(double a, double b) {
  const double sum = a + b, of_b = sum - a, of_a = sum - of_b;
  return {sum, (a - of_a) + (b - of_b)};
}

std::pair<double, double> two_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

// An exact sum as doubles that do not overlap, of growing size.
template <int capacity>
class Expansion {
 public:
  void add(double value) {  // Shewchuk's grow-expansion, zeros left out
    int kept = 0;
    for (int k = 0; k < size_; ++k) {
      const auto [sum, error] = two_sum(value, terms_[k]);
      if (error != 0.0) terms_[kept++] = error;
      value = sum;
    }
    size_ = kept;
    if (value != 0.0) terms_[size_++] = value;
  }
  void add_product(double a, double b) {
    const auto [product, error] = two_product(a, b);
    add(error);
    add(product);
  }
  void add_product(double a, double b, double c) {
    const auto [product, error] = two_product(a, b);
    add_product(error, c);
    add_product(product, c);
  }
  int sign() const { return size_ == 0 ? 0 : terms_[size_ - 1] > 0.0 ? 1 : -1; }

 private:
  std::array<double, capacity> terms_;
  int size_ = 0;
};

// det(a, b, c) added to the sum with this sign: 24 terms
template <class Sum>
void add_determinant(Sum& sum, double sign, Vec3 a, Vec3 b, Vec3 c) {
  sum.add_product(sign * a.x, b.y, c.z);
  sum.add_product(-sign * a.x, b.z, c.y);
  sum.add_product(sign * a.y, b.z, c.x);
  sum.add_product(-sign * a.y, b.x, c.z);
  sum.add_product(sign * a.z, b.x, c.y);
  sum.add_product(-sign * a.z, b.y, c.x);
}

// det(a - d, b - d, c - d) = det(a, b, c) - det(d, b, c) - det(a, d, c) - det(a, b, d)
int exact_orientation(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  Expansion<96> sum;
  add_determinant(sum, 1.0, a, b, c);
  add_determinant(sum, -1.0, d, b, c);
  add_determinant(sum, -1.0, a, d, c);
  add_determinant(sum, -1.0, a, b, d);
  return sum.sign();
}

int sign(double value) {
  return value > 0.0 ? 1 : value < 0.0 ? -1 : 0;
}

}  // namespace

int orientation(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  constexpr double kError = 1e-15;  // above Shewchuk's (7 + 56 eps) eps, eps = 2^-53
  const Vec3 u = a - d, v = b - d, w = c - d;
  const double yz = v.y * w.z, zy = v.z * w.y, zx = v.z * w.x, xz = v.x * w.z, xy = v.x * w.y, yx = v.y * w.x;
  const double value = u.x * (yz - zy) + u.y * (zx - xz) + u.z * (xy - yx);
  const double size = std::abs(u.x) * (std::abs(yz) + std::abs(zy)) + std::abs(u.y) * (std::abs(zx) + std::abs(xz)) +
                      std::abs(u.z) * (std::abs(xy) + std::abs(yx));
  if (std::abs(value) > kError * size) return sign(value);
  return exact_orientation(a, b, c, d);
}

int orientation_in_plane(int axis, Vec3 a, Vec3 b, Vec3 c) {
  constexpr double kError = 4e-16;  // above Shewchuk's (3 + 16 eps) eps
  const auto first = axis == 0 ? &Vec3::y : axis == 1 ? &Vec3::z : &Vec3::x;
  const auto second = axis == 0 ? &Vec3::z : axis == 1 ? &Vec3::x : &Vec3::y;
  const double ax = a.*first, ay = a.*second, bx = b.*first, by = b.*second, cx = c.*first, cy = c.*second;
  const double left = (ax - cx) * (by - cy), right = (ay - cy) * (bx - cx);
  if (std::abs(left - right) > kError * (std::abs(left) + std::abs(right))) return sign(left - right);
  Expansion<12> sum;
  for (const auto& [p, q] : {std::pair(ax, by), std::pair(bx, cy), std::pair(cx, ay)}) sum.add_product(p, q);
  for (const auto& [p, q] : {std::pair(ay, bx), std::pair(by, cx), std::pair(cy, ax)}) sum.add_product(-p, q);
  return sum.sign();
}

}  // namespace qlb
