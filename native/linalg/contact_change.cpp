#include "linalg/contact_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "contact/jacobi.hpp"

namespace qlb {
namespace {

using Vector = std::array<double, 12>;  // one for each of four nodes
using Weights = std::array<double, 4>;

// Where in `a` and in `b`, which is ascending, the keys are that both have, in ascending order of the keys.
std::vector<std::pair<std::int64_t, std::int64_t>> in_common(std::span<const std::int64_t> a,
                                                             std::span<const std::int64_t> b) {
  std::vector<std::pair<std::int64_t, std::int64_t>> keyed(a.size()), pairs;  // key and place in a
  for (std::size_t i = 0; i < a.size(); ++i) keyed[i] = {a[i], i};
  if (!std::ranges::is_sorted(a)) std::ranges::sort(keyed);
  pairs.reserve(std::min(a.size(), b.size()));
  auto next = b.begin();
  for (const auto& [key, place] : keyed) {
    next = std::find_if(next, b.end(), [&](std::int64_t other) { return other >= key; });
    if (next == b.end()) break;
    if (*next == key) pairs.emplace_back(place, next - b.begin());
  }
  return pairs;
}

double dot3(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

int longest(const Vector& a) {
  int at = 0;
  for (int i = 1; i < 4; ++i)
    if (dot3(&a[3 * i], &a[3 * i]) > dot3(&a[3 * at], &a[3 * at])) at = i;
  return at;
}

// What each of four nodes has of the vector at node `at`; infinite where that is 0.
Weights weights(const Vector& a, int at) {
  const double length = dot3(&a[3 * at], &a[3 * at]);
  Weights w;
  for (int i = 0; i < 4; ++i)
    w[i] = length > 0.0 ? dot3(&a[3 * i], &a[3 * at]) / length : std::numeric_limits<double>::infinity();
  return w;
}

// The sum of k a a^T over the two terms of friction, at node `at`.
Square<3> block(const std::array<Vector, 2>& a, const double* stiffness, int at) {
  Square<3> sum{};
  for (int t = 0; t < 2; ++t)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum[i][j] += stiffness[t] * a[t][3 * at + i] * a[t][3 * at + j];
  return sum;
}

double along(const std::array<double, 3>& axis, const Square<3>& A) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += axis[i] * dot3(A[i].data(), axis.data());
  return sum;
}

class Comparison {
 public:
  Comparison(const ContactTerms& now, const ContactTerms& held, const WoodburyInverse& inverse, const Nearness& near)
      : now_(now), held_(held), inverse_(inverse), near_(near), small_(near.small * near.scale) {
    lacking_ = now.terms.all_stiffness();
    change_.resize(held.terms.size());
    std::ranges::transform(held.terms.all_stiffness(), change_.begin(), std::negate<>());
  }

  ContactChange result() {
    for (const auto& [here, there] : in_common(now_.keys, held_.keys)) compare_normals(here, there);
    for (const auto& [here, there] : in_common(now_.sliding, held_.sliding))
      compare_sliding(now_.keys.size() + 2 * here, held_.keys.size() + 2 * there);
    RankOneTerms terms;
    terms.reserve(now_.terms.size() + std::ssize(change_) + turned_.size());
    terms.add(now_.terms);
    for (std::size_t j = 0; j < lacking_.size(); ++j) terms.set_stiffness(j, lacking_[j]);
    for (std::size_t k = 0; k < change_.size(); ++k)
      if (std::abs(change_[k]) > small_) terms.add(held_.terms.nodes(k), held_.terms.all_vectors()[k], change_[k]);
    terms.add(turned_);
    const std::int64_t framed = terms.size() - now_.terms.size();
    return {std::move(terms), framed};
  }

 private:
  bool alike(double a, double b) const {
    return (a <= near_.same * b && b <= near_.same * a) || (a <= small_ && b <= small_);
  }

  // Of now, in the frame of the factor.
  Vector pulled_back(std::int64_t row) const {
    Vector out;
    inverse_.pull_back(now_.terms.nodes(row), now_.terms.all_vectors()[row], out.data());
    return out;
  }

  const Vector& as_held(std::int64_t row) const { return held_.terms.all_vectors()[row]; }

  // Along nearly the same normal only the change counts.
  void compare_normals(std::int64_t here, std::int64_t there) {
    const double now = now_.terms.stiffness(here), then = held_.terms.stiffness(there);
    const Vector a = pulled_back(here), &b = as_held(there);
    double turn = 0.0;
    for (int i = 0; i < 12; ++i) turn += (a[i] - b[i]) * (a[i] - b[i]);
    if (!(std::max(now, then) * turn <= 0.5 * near_.scale)) return;
    lacking_[here] = 0.0;
    change_[there] = alike(now, then) ? 0.0 : now - then;
  }

  // The two terms of friction turn with the slip; compared are the 3x3 blocks that they make at one node of a contact.
  void compare_sliding(std::int64_t here, std::int64_t there) {
    const std::array<Vector, 2> a{pulled_back(here), pulled_back(here + 1)}, b{as_held(there), as_held(there + 1)};
    const int at = longest(b[0]);
    const Weights weight = weights(b[0], at), weight_now = weights(a[0], at);
    double shift = 0.0;
    for (int i = 0; i < 4; ++i) shift += (weight[i] - weight_now[i]) * (weight[i] - weight_now[i]);
    if (!(shift <= near_.shifted)) return;
    lacking_[here] = lacking_[here + 1] = change_[there] = change_[there + 1] = 0.0;
    const Square<3> now = block(a, &now_.terms.all_stiffness()[here], at);
    const Square<3> then = block(b, &held_.terms.all_stiffness()[there], at);
    Square<3> difference, axes;
    double most = 0.0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) most = std::max(most, std::abs(difference[i][j] = now[i][j] - then[i][j]));
    if (!(most > small_)) return;
    jacobi_eigen<3>(difference, axes);
    for (int k = 0; k < 3; ++k)
      if (std::abs(difference[k][k]) > small_ && !alike(along(axes[k], now), along(axes[k], then)))
        add_turned(there, weight, axes[k], difference[k][k]);
  }

  void add_turned(std::int64_t there, const Weights& weight, const std::array<double, 3>& axis, double stiffness) {
    turned_.add(held_.terms.nodes(there), weight, axis, stiffness);
  }

  const ContactTerms &now_, &held_;
  const WoodburyInverse& inverse_;
  Nearness near_;
  double small_;
  std::vector<double> lacking_, change_;  // beside the factor: of the terms of now, of those that it holds
  RankOneTerms turned_;                   // of friction, by eigenvectors
};

void check(const ContactTerms& terms, const char* name) {
  if (std::ssize(terms.keys) + 2 * std::ssize(terms.sliding) > terms.terms.size())
    throw std::invalid_argument(std::string(name) + ": fewer terms than keys and sliding say");
}

}  // namespace

ContactChange contact_change(const ContactTerms& now, const ContactTerms& held, const WoodburyInverse& inverse,
                             const Nearness& near) {
  check(now, "now");
  check(held, "held");
  if (!std::ranges::is_sorted(held.keys) || !std::ranges::is_sorted(held.sliding))
    throw std::invalid_argument("held: keys and sliding must be ascending");
  return Comparison(now, held, inverse, near).result();
}

}  // namespace qlb
