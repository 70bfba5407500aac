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
    next = std::find_if(next, b.end(), [least = key](std::int64_t other) { return other >= least; });
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

// Stiffness along one direction, now and in the factor.
struct Pair {
  double now, then;

  double change() const { return now - then; }
  bool differs(const Nearness& near, double scale) const {
    return std::abs(change()) > near.small * scale && !(now <= near.same * then && then <= near.same * now);
  }
};

class Comparison {
 public:
  Comparison(const ContactTerms& now, const ContactTerms& held, const WoodburyInverse& inverse, const Comparing& by)
      : now_(now), held_(held), inverse_(inverse), by_(by) {
    for (const double stiffness : now.terms.all_stiffness()) lacking_.push_back({stiffness, 0.0});
    for (const double stiffness : held.terms.all_stiffness()) kept_.push_back({0.0, stiffness});
  }

  ContactChange result() {
    for (const auto& [here, there] : in_common(now_.keys, held_.keys)) compare_normals(here, there);
    for (const auto& [here, there] : in_common(now_.sliding, held_.sliding))
      compare_sliding(now_.keys.size() + 2 * here, held_.keys.size() + 2 * there);
    return beside(level());
  }

 private:
  const Nearness& level() const {
    const auto fits = [&](const Nearness& near) {
      const auto differs = [&](const Pair& pair) { return pair.differs(near, by_.scale); };
      return std::ranges::count_if(lacking_, differs) + std::ranges::count_if(kept_, differs) +
                 std::ranges::count_if(turned_, differs) <=
             by_.most;
    };
    const auto found = std::ranges::find_if(by_.levels, fits);
    return found == by_.levels.end() ? by_.levels.back() : *found;
  }

  ContactChange beside(const Nearness& near) const {
    RankOneTerms terms;
    terms.reserve(now_.terms.size() + std::ssize(kept_) + std::ssize(turned_));
    terms.add(now_.terms);
    for (std::size_t j = 0; j < lacking_.size(); ++j)
      terms.set_stiffness(j, lacking_[j].differs(near, by_.scale) ? lacking_[j].change() : 0.0);
    for (std::size_t k = 0; k < kept_.size(); ++k)
      if (kept_[k].differs(near, by_.scale))
        terms.add(held_.terms.nodes(k), held_.terms.all_vectors()[k], kept_[k].change());
    for (std::size_t k = 0; k < turned_.size(); ++k)
      if (turned_[k].differs(near, by_.scale))
        terms.add(held_.terms.nodes(axes_[k].of), axes_[k].weight, axes_[k].axis, turned_[k].change());
    const std::int64_t framed = terms.size() - now_.terms.size();
    return {std::move(terms), framed};
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
    if (!(std::max(now, then) * turn <= 0.5 * by_.scale)) return;
    lacking_[here] = {};
    kept_[there].now = now;
  }

  // The two terms of friction turn with the slip; compared are the 3x3 blocks that they make at one node of a contact.
  void compare_sliding(std::int64_t here, std::int64_t there) {
    const std::array<Vector, 2> a{pulled_back(here), pulled_back(here + 1)}, b{as_held(there), as_held(there + 1)};
    const int at = longest(b[0]);
    const Weights weight = weights(b[0], at), weight_now = weights(a[0], at);
    double shift = 0.0;
    for (int i = 0; i < 4; ++i) shift += (weight[i] - weight_now[i]) * (weight[i] - weight_now[i]);
    if (!(shift <= by_.shifted)) return;
    lacking_[here] = lacking_[here + 1] = kept_[there] = kept_[there + 1] = {};
    const Square<3> now = block(a, &now_.terms.all_stiffness()[here], at);
    const Square<3> then = block(b, &held_.terms.all_stiffness()[there], at);
    Square<3> difference, axes;
    double most = 0.0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) most = std::max(most, std::abs(difference[i][j] = now[i][j] - then[i][j]));
    if (!(most > by_.levels.front().small * by_.scale)) return;
    jacobi_eigen<3>(difference, axes);
    for (int k = 0; k < 3; ++k) {
      turned_.push_back({along(axes[k], now), along(axes[k], then)});
      axes_.push_back({there, weight, axes[k]});
    }
  }

  struct Axis {
    std::int64_t of;  // term that the factor holds
    Weights weight;
    std::array<double, 3> axis;
  };

  const ContactTerms &now_, &held_;
  const WoodburyInverse& inverse_;
  const Comparing& by_;
  std::vector<Pair> lacking_, kept_;  // along the terms of now, and along those that the factor holds
  std::vector<Pair> turned_;          // of friction, along eigenvectors
  std::vector<Axis> axes_;            // these
};

void check(const ContactTerms& terms, const char* name) {
  if (std::ssize(terms.keys) + 2 * std::ssize(terms.sliding) > terms.terms.size())
    throw std::invalid_argument(std::string(name) + ": fewer terms than keys and sliding say");
}

}  // namespace

ContactChange contact_change(const ContactTerms& now, const ContactTerms& held, const WoodburyInverse& inverse,
                             const Comparing& by) {
  if (by.levels.empty()) throw std::invalid_argument("levels: none");
  check(now, "now");
  check(held, "held");
  if (!std::ranges::is_sorted(held.keys) || !std::ranges::is_sorted(held.sliding))
    throw std::invalid_argument("held: keys and sliding must be ascending");
  return Comparison(now, held, inverse, by).result();
}

}  // namespace qlb
