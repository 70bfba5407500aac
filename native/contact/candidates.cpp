#include "contact/candidates.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact/additive_ccd.hpp"

namespace qlb {
namespace {

constexpr std::int64_t kWorthThreads = 1024;  // pairs

Vec3 node_vector(const double* values, std::int32_t node) {
  return load3(values + 3 * static_cast<std::int64_t>(node));
}

// Positions relative to node 0 of the pair: what is rounded then is the size of the pair, not its place.
std::array<Vec3, 4> load_positions(const double* x, const std::array<std::int32_t, 4>& nodes) {
  const Vec3 origin = node_vector(x, nodes[0]);
  return {Vec3{}, node_vector(x, nodes[1]) - origin, node_vector(x, nodes[2]) - origin,
          node_vector(x, nodes[3]) - origin};
}

std::array<Vec3, 4> load_motion(const double* p, const std::array<std::int32_t, 4>& nodes) {
  return {node_vector(p, nodes[0]), node_vector(p, nodes[1]), node_vector(p, nodes[2]), node_vector(p, nodes[3])};
}

template <class T, std::size_t A, std::size_t B>
std::array<T, 4> join(const std::array<T, A>& a, const std::array<T, B>& b) {
  static_assert(A + B == 4);
  std::array<T, 4> both;
  std::ranges::copy(b, std::ranges::copy(a, both.begin()).out);
  return both;
}

void set_lane(double to[3][kPairs], int lane, Vec3 v) {
  to[0][lane] = v.x;
  to[1][lane] = v.y;
  to[2][lane] = v.z;
}

// Takes out the pairs for which planes are found that keep all of the boxes of one primitive more than `distance` from
// those of the other. boxes: of each slot.
template <std::size_t A, std::size_t B>
void drop_separated(const TreePair<A, B>& trees, const std::vector<Box>& boxes, double distance,
                    std::vector<Pair>& places) {
  const auto apart = pair_kernels().apart_in_boxes[A - 1];
  std::size_t kept = 0;
  PairMotion motion{};
  for (std::size_t first = 0; first < places.size(); first += kPairs) {
    const int count = static_cast<int>(std::min<std::size_t>(kPairs, places.size() - first));
    for (int lane = 0; lane < count; ++lane) {
      const auto& [i, j] = places[first + lane];
      const auto slots = join(trees.a->slots[i], trees.b->slots[j]);
      for (int node = 0; node < 4; ++node) {
        set_lane(motion.a[node], lane, boxes[slots[node]].lo);
        set_lane(motion.b[node], lane, boxes[slots[node]].hi);
      }
    }
    const unsigned far = apart(motion, distance);
    for (int lane = 0; lane < count; ++lane) {
      const Pair pair = places[first + lane];
      places[kept] = pair;
      kept += ~far >> lane & 1;
    }
  }
  places.resize(kept);
}

}  // namespace

Candidates::Candidates(std::shared_ptr<const ContactSurface> surface, int threads)
    : surface_(std::move(surface)), threads_(std::max(threads, 1)), trees_(*surface_), collector_(threads_) {}

void Candidates::set_slack(double slack) {
  if (!(slack > 0.0 && slack < 1.0))
    throw std::invalid_argument("slack is " + std::to_string(slack) + ", must be above 0 and below 1");
  slack_ = slack;
}

void Candidates::check_finite(const double* values, const char* name) const {
  Vec3 sum;  // of zeros, unless one is not finite
  for (const std::int32_t node : surface_->vertices()) sum = sum + 0.0 * node_vector(values, node);
  if (sum.x + sum.y + sum.z == 0.0) return;
  for (const std::int32_t node : surface_->vertices()) {
    const Vec3 v = node_vector(values, node);
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw std::invalid_argument(std::string(name) + " of node " + std::to_string(node) + " is not finite");
  }
}

Candidates::Frame Candidates::mean_frame(const GroupTrees& group, const double* x, const double* p) const {
  Frame frame;
  for (std::int32_t slot = group.first; slot < group.last; ++slot) {
    const Vec3 start = node_vector(x, trees_.nodes[slot]);
    frame.start = frame.start + start;
    frame.end = frame.end + (start + node_vector(p, trees_.nodes[slot]));
  }
  const double weight = 1.0 / std::max(group.last - group.first, 1);
  return {weight * frame.start, weight * frame.end};
}

Box Candidates::path(std::int32_t slot, const Frame& frame, const double* x, const double* p) const {
  const Vec3 start = node_vector(x, trees_.nodes[slot]);
  Box box;
  box.add(start - frame.start);
  box.add(start + node_vector(p, trees_.nodes[slot]) - frame.end);
  return box;
}

void Candidates::build(const double* x, const double* p, double margin, double radius) {
  for (const auto& [value, name] : {std::pair(margin, "margin"), std::pair(radius, "radius")})
    if (!(value >= 0.0 && std::isfinite(value)))
      throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) + ", must be at least 0");
  check_finite(x, "x");
  check_finite(p, "p");
  absolute_.resize(trees_.nodes.size());
  relative_.resize(trees_.nodes.size());
  double largest = 0.0;
  for (const GroupTrees& group : trees_.groups) {
    const Frame mean = mean_frame(group, x, p);
    for (std::int32_t slot = group.first; slot < group.last; ++slot) {
      absolute_[slot] = path(slot, Frame{}, x, p).grown(margin);
      relative_[slot] = path(slot, mean, x, p).grown(margin);
      for (const Vec3& v : {absolute_[slot].lo, absolute_[slot].hi})
        largest = std::max({largest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    }
  }
  vertex_faces_.clear();
  edge_edges_.clear();
  radius += 1e-14 * largest;  // rounding
  find_pairs(relative_, true, radius);
  find_pairs(absolute_, false, radius);
  built_ = true;
}

void Candidates::find_pairs(const std::vector<Box>& boxes, bool within_groups, double radius) {
  const auto count = static_cast<std::int32_t>(trees_.groups.size());
  std::vector<TreePair<1, 3>> vertex_faces;
  std::vector<TreePair<2, 2>> edge_edges;
  for (std::int32_t g = 0; g < count; ++g)
    for (std::int32_t h = 0; h < count; ++h) {
      if ((g == h) != within_groups || !surface_->allowed(g, h)) continue;
      const GroupTrees &a = trees_.groups[g], &b = trees_.groups[h];
      vertex_faces.push_back({&a.vertices, &b.faces});
      if (g <= h) edge_edges.push_back({&a.edges, &b.edges});
    }
  if (vertex_faces.empty()) return;
  std::vector<SmallBox> small;  // that meet where the boxes are within the radius
  small.reserve(boxes.size());
  for (const Box& box : boxes) small.emplace_back(box.grown(0.5 * radius));
  for (GroupTrees& group : trees_.groups)
    if (within_groups ? group.meets_itself : group.meets_others) group.refit(small);
  const auto keep = [&](const auto& trees, std::vector<Pair>& places) { drop_separated(trees, boxes, radius, places); };
  search(vertex_faces, collector_, vertex_faces_, keep);
  const std::size_t known = edge_edges_.size();
  search(edge_edges, collector_, edge_edges_, keep);
  for (std::size_t k = known; k < edge_edges_.size(); ++k)
    if (edge_edges_[k][0] > edge_edges_[k][1]) std::swap(edge_edges_[k][0], edge_edges_[k][1]);
}

bool Candidates::covers(const double* x, const double* p) const {
  const auto inside = [&](const Box& box, const Box& way) { return box.contains(way.lo) && box.contains(way.hi); };
  const auto finite = [&](std::int32_t node) {
    const Vec3 sum = node_vector(x, node) + node_vector(p, node);
    return std::isfinite(sum.x + sum.y + sum.z);
  };
  if (!built_) return false;
  for (const GroupTrees& group : trees_.groups) {
    const Frame mean = group.meets_itself ? mean_frame(group, x, p) : Frame{};
    for (std::int32_t slot = group.first; slot < group.last; ++slot) {
      if (!finite(trees_.nodes[slot])) return false;
      if (group.meets_others && !inside(absolute_[slot], path(slot, Frame{}, x, p))) return false;
      if (group.meets_itself && !inside(relative_[slot], path(slot, mean, x, p))) return false;
    }
  }
  return true;
}

std::array<std::int32_t, 4> Candidates::pair_nodes(std::int64_t pair) const {
  const auto first = static_cast<std::int64_t>(vertex_faces_.size());
  if (pair < first) {
    const auto& [node, face] = vertex_faces_[pair];
    const auto& [a, b, c] = surface_->faces()[face];
    return {node, a, b, c};
  }
  const auto& [e, f] = edge_edges_[pair - first];
  const auto& edges = surface_->edges();
  return {edges[e][0], edges[e][1], edges[f][0], edges[f][1]};
}

unsigned Candidates::pairs_in_the_way(const double* x, const double* p, std::int64_t begin, std::int64_t end) const {
  PairMotion motion{};
  const int count = static_cast<int>(end - begin), first = begin < vertex_face_count() ? 1 : 2;
  for (int lane = 0; lane < count; ++lane) {
    const auto nodes = pair_nodes(begin + lane);
    const auto start = load_positions(x, nodes), way = load_motion(p, nodes);
    for (int node = 0; node < 4; ++node) {
      set_lane(motion.a[node], lane, start[node]);
      set_lane(motion.b[node], lane, start[node] + way[node]);
    }
  }
  return ~pair_kernels().apart_on_way[first - 1](motion, slack_) & ((1u << count) - 1);
}

double Candidates::step_bound(const double* x, const double* p) {
  check_finite(x, "x");
  check_finite(p, "p");
  using Bound = std::pair<double, std::int64_t>;  // the step and, among equals, the first pair
  const auto count = pairs(), faces = vertex_face_count();
  const auto face_batches = (faces + kPairs - 1) / kPairs, edge_batches = (count - faces + kPairs - 1) / kPairs;
  Bound least{1.0, -1};
#pragma omp parallel num_threads(threads_) if (count > kWorthThreads)
  {
    // A pair is given up once it is above the least bound this thread has seen, which cannot change the minimum.
    Bound mine{1.0, -1};
#pragma omp for schedule(static) nowait
    for (std::int64_t batch = 0; batch < face_batches + edge_batches; ++batch) {
      const bool of_faces = batch < face_batches;
      const auto begin = of_faces ? kPairs * batch : faces + kPairs * (batch - face_batches);
      const auto end = std::min(begin + kPairs, of_faces ? faces : count);
      for (unsigned left = pairs_in_the_way(x, p, begin, end); left != 0; left &= left - 1) {
        const auto pair = begin + std::countr_zero(left);
        const auto nodes = pair_nodes(pair);
        const auto start = load_positions(x, nodes), motion = load_motion(p, nodes);
        const double step = of_faces ? additive_ccd<1>(start, motion, slack_, mine.first)
                                     : additive_ccd<2>(start, motion, slack_, mine.first);
        mine = step < mine.first ? Bound{step, pair} : mine;
      }
    }
#pragma omp critical(qlb_step_bound)
    if (mine.second >= 0) least = std::min(least, mine);
  }
  limited_ = least.second >= 0;
  if (limited_) limiting_ = pair_nodes(least.second);
  return least.first;
}

double Candidates::squared_distance(const double* x, std::int64_t pair) const {
  const auto at = load_positions(x, pair_nodes(pair));
  return (pair < vertex_face_count() ? closest_points<1>(at) : closest_points<2>(at)).distance2;
}

double Candidates::minimum_distance(const double* x) const {
  const auto count = pairs();
  double least = std::numeric_limits<double>::infinity();
#pragma omp parallel for schedule(static) num_threads(threads_) reduction(min : least) if (count > kWorthThreads)
  for (std::int64_t pair = 0; pair < count; ++pair) least = std::min(least, squared_distance(x, pair));
  return std::sqrt(least);
}

std::vector<std::array<std::int32_t, 4>> Candidates::near(const double* x, double radius) const {
  std::vector<std::array<std::int32_t, 4>> found;
  for (std::int64_t pair = 0; pair < pairs(); ++pair)
    if (squared_distance(x, pair) < radius * radius) found.push_back(pair_nodes(pair));
  return found;
}

}  // namespace qlb
