#include "contact/surface.hpp"

#include <algorithm>
#include <stdexcept>

#include "contact/vec3.hpp"

namespace qlb {

ContactSurface::ContactSurface(std::span<const double> rest, std::span<const std::int32_t> faces,
                               std::span<const std::int32_t> group, std::span<const std::uint8_t> allowed)
    : groups_(group.empty() ? 0 : 1 + *std::ranges::max_element(group)),
      group_(group.begin(), group.end()),
      rest_(rest.begin(), rest.end()),
      allowed_(allowed.begin(), allowed.end()) {
  if (rest.size() != 3 * group.size()) throw std::invalid_argument("rest and group have different numbers of nodes");
  if (faces.size() % 3 != 0) throw std::invalid_argument("faces must have shape (f, 3)");
  if (static_cast<std::int64_t>(allowed.size()) != static_cast<std::int64_t>(groups_) * groups_)
    throw std::invalid_argument("allowed must have shape (groups, groups)");
  for (const std::int32_t node : faces)
    if (node < 0 || node >= nodes()) throw std::invalid_argument("faces name a node that does not exist");

  for (std::size_t f = 0; f < faces.size(); f += 3) faces_.push_back({faces[f], faces[f + 1], faces[f + 2]});
  for (const auto& [a, b, c] : faces_)
    for (const auto& [i, j] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
      edges_.push_back({std::min(i, j), std::max(i, j)});
  std::ranges::sort(edges_);
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  vertices_.assign(faces.begin(), faces.end());
  std::ranges::sort(vertices_);
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());

  node_area_.assign(group.size(), 0.0);
  edge_area_.assign(edges_.size(), 0.0);
  const auto at = [&](std::int32_t node) { return load3(&rest[3 * static_cast<std::size_t>(node)]); };
  for (const auto& [a, b, c] : faces_) {
    const double third = norm(cross(at(b) - at(a), at(c) - at(a))) / 6.0;
    for (const std::int32_t node : {a, b, c}) node_area_[node] += third;
    for (const auto& [i, j] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      const std::array<std::int32_t, 2> edge{std::min(i, j), std::max(i, j)};
      edge_area_[std::ranges::lower_bound(edges_, edge) - edges_.begin()] += third;
    }
  }
  for (const auto& [a, b] : edges_) edge_length2_.push_back(dot(at(b) - at(a), at(b) - at(a)));
}

}  // namespace qlb
