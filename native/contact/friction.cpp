#include "contact/friction.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace qlb {
namespace {

void check_size(std::size_t size, std::size_t expected, const char* name) {
  if (size != expected)
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(size) + " entries, expected " +
                                std::to_string(expected));
}

void check_not_negative(std::span<const double> values, const char* name) {
  for (const double value : values)
    if (!(value >= 0.0) || !std::isfinite(value))
      throw std::invalid_argument(std::string(name) + " holds " + std::to_string(value) +
                                  ", must be finite and not negative");
}

}  // namespace

Friction::Friction(std::span<const std::int32_t> nodes, std::span<const double> gamma, std::span<const double> normal,
                   std::span<const double> normal_force, std::span<const double> mu, std::span<const double> slip) {
  const std::size_t size = normal_force.size();
  check_size(nodes.size(), 4 * size, "nodes");
  check_size(gamma.size(), 4 * size, "gamma");
  check_size(normal.size(), 3 * size, "normal");
  check_size(mu.size(), size, "mu");
  if (!slip.empty()) check_size(slip.size(), 3 * size, "slip");
  check_not_negative(normal_force, "normal_force");
  check_not_negative(mu, "mu");
  for (std::size_t k = 0; k < size; ++k) {
    Contact c{.tangents = tangents(load3(&normal[3 * k])),
              .slip = slip.empty() ? Vec3{} : load3(&slip[3 * k]),
              .limit = mu[k] * normal_force[k]};
    std::copy_n(&nodes[4 * k], 4, c.nodes.begin());
    std::copy_n(&gamma[4 * k], 4, c.gamma.begin());
    if (*std::ranges::min_element(c.nodes) < 0) throw std::invalid_argument("nodes holds a negative index");
    last_node_ = std::max(last_node_, *std::ranges::max_element(c.nodes));
    contacts_.push_back(c);
  }
}

std::vector<double> FrictionTerms::secant(const FrictionTerms& before) const {
  if (before.slip.size() != slip.size()) throw std::invalid_argument("before: friction of other contacts");
  std::vector<double> found(slip.size(), 0.0);
  for (std::size_t k = 0; k < slip.size(); ++k) {
    double length = 0.0, growth = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double step = slip[k][i] - before.slip[k][i];
      length += step * step;
      growth += step * (stiffness[2 * k + 1] * slip[k][i] - before.stiffness[2 * k + 1] * before.slip[k][i]);
    }
    if (length > 0.0) found[k] = growth / length;
  }
  return found;
}

FrictionTerms Friction::evaluate(const double* x, const double* base, std::int64_t count, double epsilon, double scale,
                                 double* gradient) const {
  if (last_node_ >= count)
    throw std::invalid_argument("nodes name node " + std::to_string(last_node_) + ", x has " + std::to_string(count));
  if (!(epsilon > 0.0)) throw std::invalid_argument("epsilon is " + std::to_string(epsilon) + ", must be positive");
  FrictionTerms terms;
  for (const Contact& c : contacts_) {
    Vec3 moved = -1.0 * c.slip;
    for (int i = 0; i < 4; ++i) {
      const std::int64_t at = 3 * static_cast<std::int64_t>(c.nodes[i]);
      moved = moved + c.gamma[i] * (load3(x + at) - load3(base + at));
    }
    const auto [t1, t2] = c.tangents;
    const double u1 = dot(t1, moved), u2 = dot(t2, moved), y = std::sqrt(u1 * u1 + u2 * u2);
    const double c1 = y > 0.0 ? u1 / y : 1.0, c2 = y > 0.0 ? u2 / y : 0.0, unit = scale * c.limit;
    const Vec3 along = c1 * t1 + c2 * t2, across = c1 * t2 - c2 * t1;
    const Derivatives f = smooth_friction(y, epsilon);
    terms.slip.push_back({y * along.x, y * along.y, y * along.z});
    terms.energy += unit * f.value;
    for (int i = 0; i < 4; ++i)
      add3(unit * f.first * c.gamma[i] * along, gradient + 3 * static_cast<std::int64_t>(c.nodes[i]));
    const double hold = y < epsilon ? (2.0 - y / epsilon) / epsilon : 1.0 / y;  // f1(y)/y
    for (const auto& [axis, stiffness] : {std::pair(along, f.second), std::pair(across, hold)}) {
      terms.nodes.push_back(c.nodes);
      terms.gamma.push_back(c.gamma);
      terms.axis.push_back({axis.x, axis.y, axis.z});
      terms.stiffness.push_back(unit * stiffness);
    }
  }
  return terms;
}

}  // namespace qlb
