#include "contact/barrier.hpp"

#include <algorithm>
#include <stdexcept>

#include "contact/contact_hessian.hpp"

namespace qlb {
namespace {

constexpr std::int64_t kChunk = 1024;  // candidates gone over together: the grouping never depends on the threads

std::array<Vec3, 4> positions(const double* x, const std::array<std::int32_t, 4>& nodes) {
  std::array<Vec3, 4> at;
  for (int i = 0; i < 4; ++i) at[i] = load3(x + 3 * static_cast<std::int64_t>(nodes[i]));
  return at;
}

// Whether the boxes around the first `split` points and the others are `reach` or more apart along some axis.
template <int split>
bool boxes_apart(const std::array<Vec3, 4>& x, double reach) {
  const auto apart = [&](double Vec3::* c) {
    double low[2] = {x[0].*c, x[split].*c}, high[2] = {low[0], low[1]};
    for (int i = 1; i < 4; ++i) {
      const int side = i >= split;
      low[side] = std::min(low[side], x[i].*c);
      high[side] = std::max(high[side], x[i].*c);
    }
    return low[1] - high[0] >= reach || low[0] - high[1] >= reach;
  };
  return apart(&Vec3::x) || apart(&Vec3::y) || apart(&Vec3::z);
}

void check_pairs(std::span<const std::int32_t> pairs, std::int64_t first, std::int64_t second, const char* name) {
  if (pairs.size() % 2 != 0) throw std::invalid_argument(std::string(name) + " must have shape (k, 2)");
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::int64_t limit = k % 2 == 0 ? first : second;
    if (pairs[k] < 0 || pairs[k] >= limit)
      throw std::invalid_argument(std::string(name) + ": index " + std::to_string(pairs[k]) + " is outside [0, " +
                                  std::to_string(limit) + ")");
  }
}

void check_positive(double value, const char* name) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) + ", must be positive and finite");
}

}  // namespace

// A contact with what its gradient needs beyond a ContactSet.
struct Barrier::Contact {
  ContactKind kind;
  std::int64_t key;
  std::array<std::int32_t, 4> nodes;
  std::array<std::int32_t, 2> groups;
  double weight, dhat = 0.0, threshold = 0.0;
  std::int8_t sign = 1;
  std::array<double, 4> gamma{};
  Vec3 normal;
  double distance, energy, force, stiffness;
  std::array<Vec3, 2> turn{};  // what the mollifier adds to the gradient in e1 and e2

  void evaluate(Derivatives potential, const Mollifier& mollifier) {
    energy = std::isfinite(potential.value) ? mollifier.m.value * potential.value : potential.value;
    force = -mollifier.m.value * potential.first;
    stiffness = mollifier.m.value * potential.second;
    if (mollifier.active() && std::isfinite(energy))
      for (int e = 0; e < 2; ++e) turn[e] = potential.value * mollifier.m.first * mollifier.c_slope[e];
  }

  void add_gradient(double* gradient) const {
    for (int i = 0; i < 4; ++i)
      add3(-force * gamma[i] * normal + (i % 2 == 0 ? -1.0 : 1.0) * turn[i / 2],
           gradient + 3 * static_cast<std::int64_t>(nodes[i]));
  }

  void append_to(ContactSet& set) const {
    set.nodes.push_back(nodes);
    set.gamma.push_back(gamma);
    set.normal.push_back({normal.x, normal.y, normal.z});
    set.distance.push_back(distance);
    set.force.push_back(force);
    set.stiffness.push_back(stiffness);
    set.key.push_back(key);
    set.groups.push_back(groups);
    set.weight.push_back(weight);
    set.dhat.push_back(dhat);
    set.mollifier_threshold.push_back(threshold);
    set.sign.push_back(sign);
    set.energy += energy;
    set.minimum_distance = std::min(set.minimum_distance, distance);
  }
};

Barrier::Barrier(std::shared_ptr<const ContactSurface> surface, double dhat, double stiffness, int threads,
                 const std::string& kind)
    : surface_(std::move(surface)),
      dhat_(dhat),
      stiffness_(stiffness),
      threads_(threads),
      penalty_(kind == "penalty"),
      reach_((penalty_ ? 2.0 : 1.0) * dhat) {
  check_positive(dhat, "dhat");
  check_positive(stiffness, "stiffness");
  if (threads < 1) throw std::invalid_argument("threads is " + std::to_string(threads) + ", must be 1 or more");
  if (kind != "barrier" && kind != "penalty")
    throw std::invalid_argument("kind is '" + kind + "', must be 'barrier' or 'penalty'");
  for (const std::size_t count : {surface_->edges().size(), surface_->faces().size(), surface_->vertices().size()})
    if (count >> kKeyBits != 0) throw std::invalid_argument("the surface has more than 2^30 primitives of a kind");
}

void Barrier::check(const CandidatePairs& candidates, const Planes& planes) const {
  const auto edges = static_cast<std::int64_t>(surface_->edges().size());
  check_pairs(candidates.vertex_faces, surface_->nodes(), static_cast<std::int64_t>(surface_->faces().size()),
              "vertex_faces");
  check_pairs(candidates.edge_edges, edges, edges, "edge_edges");
  if (!candidates.edge_sign.empty() && 2 * candidates.edge_sign.size() != candidates.edge_edges.size())
    throw std::invalid_argument("edge_sign has " + std::to_string(candidates.edge_sign.size()) +
                                " entries, expected one per pair of edges");
  for (const std::int8_t sign : candidates.edge_sign)
    if (sign != 1 && sign != -1)
      throw std::invalid_argument("edge_sign holds " + std::to_string(sign) + ", must be 1 or -1");
  if (planes.planes.size() % 4 != 0) throw std::invalid_argument("planes must have shape (q, 4)");
  if (static_cast<std::int64_t>(planes.allowed.size()) != planes.size() * surface_->groups())
    throw std::invalid_argument("plane_allowed must have shape (planes, groups)");
}

Separation Barrier::separation(ContactKind kind, const std::array<Vec3, 4>& x, double sign) const {
  return penalty_ ? signed_separation(kind, x, sign) : unsigned_separation(kind, x);
}

Derivatives Barrier::potential(double distance, double weight, double dhat) const {
  const double s = distance / dhat, unit = weight * stiffness_;
  const Derivatives f = penalty_ ? quadratic_penalty(s) : log_barrier(s);
  return {unit * dhat * f.value, unit * f.first, unit / dhat * f.second};
}

void Barrier::limit_pairs(std::span<const std::int64_t> keys, std::span<const double> dhat) {
  if (keys.size() != dhat.size()) throw std::invalid_argument("keys and dhat have different lengths");
  limited_.clear();
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (!(dhat[k] > 0.0)) throw std::invalid_argument("dhat of a pair must be positive");
    limited_.emplace_back(keys[k], std::min(dhat[k], dhat_));
  }
  std::ranges::sort(limited_);
}

double Barrier::dhat_of(std::int64_t key) const {
  const auto found = std::ranges::lower_bound(limited_, key, {}, &std::pair<std::int64_t, double>::first);
  return found != limited_.end() && found->first == key ? found->second : dhat_;
}

// Keeps the contact, filled in with what depends on the positions `at`, if the two are in reach of each other.
void Barrier::keep_near(const std::array<Vec3, 4>& at, Contact&& c, std::vector<Contact>& found) const {
  const Separation s = separation(c.kind, at, c.sign);
  if (!in_reach(s.distance, dhat_)) return;
  c.dhat = c.groups[0] == c.groups[1] ? dhat_of(c.key) : dhat_;
  if (!in_reach(s.distance, c.dhat)) return;
  c.gamma = s.closest.gamma;
  c.normal = s.normal;
  c.distance = s.distance;
  c.evaluate(potential(s.distance, c.weight, c.dhat),
             c.kind == ContactKind::edge_edge ? edge_mollifier(at, c.threshold) : Mollifier{});
  found.push_back(c);
}

void Barrier::vertex_face(const double* x, const std::int32_t* candidate, double scale,
                          std::vector<Contact>& found) const {
  const auto [node, face] = std::pair(candidate[0], candidate[1]);
  const auto& [a, b, c] = surface_->faces()[face];
  const std::array<std::int32_t, 4> nodes{node, a, b, c};
  const std::array<Vec3, 4> at = positions(x, nodes);
  if (boxes_apart<1>(at, reach_)) return;
  keep_near(at,
            {.kind = ContactKind::vertex_face,
             .key = contact_key(ContactKind::vertex_face, node, face),
             .nodes = nodes,
             .groups = {surface_->group(node), surface_->group(a)},
             .weight = scale * 0.5 * surface_->node_area(node)},
            found);
}

// The edge of lower index comes first, so that a pair is the same contact whichever way round it is named.
void Barrier::edge_edge(const double* x, const std::int32_t* candidate, std::int8_t sign, double scale,
                        std::vector<Contact>& found) const {
  const auto [first, second] = std::minmax(candidate[0], candidate[1]);
  const auto &a = surface_->edges()[first], &b = surface_->edges()[second];
  const std::array<std::int32_t, 4> nodes{a[0], a[1], b[0], b[1]};
  const std::array<Vec3, 4> at = positions(x, nodes);
  if (boxes_apart<2>(at, reach_)) return;
  keep_near(at,
            {.kind = ContactKind::edge_edge,
             .key = contact_key(ContactKind::edge_edge, first, second),
             .nodes = nodes,
             .groups = {surface_->group(a[0]), surface_->group(b[0])},
             .weight = scale * 0.25 * (surface_->edge_area(first) + surface_->edge_area(second)),
             .threshold = 1e-3 * surface_->edge_length2(first) * surface_->edge_length2(second),
             .sign = sign},
            found);
}

void Barrier::vertex_planes(const double* x, std::int32_t node, const Planes& planes, double scale,
                            std::vector<Contact>& found) const {
  const std::int32_t groups = surface_->groups(), group = surface_->group(node);
  for (std::int32_t q = 0; q < planes.size(); ++q) {
    const double* plane = &planes.planes[4 * q];
    const Vec3 normal = load3(plane);
    const double distance = dot(normal, load3(x + 3 * static_cast<std::int64_t>(node))) - plane[3];
    if (distance >= dhat_ || !planes.allowed[q * groups + group]) continue;
    Contact contact{.kind = ContactKind::plane,
                    .key = contact_key(ContactKind::plane, node, q),
                    .nodes = {node, node, node, node},
                    .groups = {group, groups + q},
                    .weight = scale * surface_->node_area(node),
                    .dhat = dhat_,
                    .gamma = {1.0, 0.0, 0.0, 0.0},
                    .normal = normal,
                    .distance = distance};
    contact.evaluate(potential(distance, contact.weight, dhat_), Mollifier{});
    found.push_back(contact);
  }
}

ContactSet Barrier::evaluate(const double* x, const CandidatePairs& candidates, const Planes& planes, double scale,
                             double* gradient) const {
  check(candidates, planes);
  const std::vector<std::int32_t>& vertices = surface_->vertices();
  const auto faces = static_cast<std::int64_t>(candidates.vertex_faces.size()) / 2;
  const auto edges = static_cast<std::int64_t>(candidates.edge_edges.size()) / 2;
  const auto total = faces + edges + (planes.size() > 0 ? static_cast<std::int64_t>(vertices.size()) : 0);
  const auto visit = [&](std::int64_t k, std::vector<Contact>& found) {
    if (k < faces) return vertex_face(x, &candidates.vertex_faces[2 * k], scale, found);
    k -= faces;
    const std::int8_t sign = candidates.edge_sign.empty() || k >= edges ? 1 : candidates.edge_sign[k];
    if (k < edges) return edge_edge(x, &candidates.edge_edges[2 * k], sign, scale, found);
    vertex_planes(x, vertices[k - edges], planes, scale, found);
  };

  const std::int64_t chunks = (total + kChunk - 1) / kChunk;
  std::vector<std::vector<Contact>> found(chunks);
#pragma omp parallel for schedule(dynamic) num_threads(threads_) if (chunks > 2)
  for (std::int64_t chunk = 0; chunk < chunks; ++chunk)
    for (std::int64_t k = chunk * kChunk; k < std::min(total, (chunk + 1) * kChunk); ++k) visit(k, found[chunk]);

  ContactSet set;
  for (const std::vector<Contact>& part : found)
    for (const Contact& contact : part) {
      contact.append_to(set);
      contact.add_gradient(gradient);
    }
  return set;
}

void Barrier::hessian_blocks(const double* x, const ContactSet& contacts, bool project, double* blocks) const {
#pragma omp parallel for schedule(static) num_threads(threads_) if (contacts.size() > 64)
  for (std::int64_t k = 0; k < contacts.size(); ++k) {
    const ContactKind kind = contacts.kind(k);
    double* block = blocks + 144 * k;
    if (kind == ContactKind::plane) {
      plane_hessian(contacts.normal[k], contacts.stiffness[k], block);
      continue;
    }
    const std::array<Vec3, 4> at = positions(x, contacts.nodes[k]);
    const Separation s = separation(kind, at, contacts.sign[k]);
    const double dhat = contacts.dhat[k];
    const bool near = in_reach(s.distance, dhat);
    const Derivatives f = near ? potential(s.distance, contacts.weight[k], dhat) : Derivatives{};
    const bool edges = kind == ContactKind::edge_edge;
    pair_hessian(at, s, f, edges ? edge_mollifier(at, contacts.mollifier_threshold[k]) : Mollifier{}, project, block);
  }
}

RankOneTerms Barrier::bending(const double* x, const ContactSet& contacts, double threshold) const {
  RankOneTerms found;
  std::vector<std::array<double, 12>> vectors;
  std::vector<double> stiffness;
  for (std::int64_t k = 0; k < contacts.size(); ++k) {
    const ContactKind kind = contacts.kind(k);
    if (kind == ContactKind::plane) continue;
    const std::array<Vec3, 4> at = positions(x, contacts.nodes[k]);
    const Separation s = separation(kind, at, contacts.sign[k]);
    if (!in_reach(s.distance, contacts.dhat[k])) continue;
    const Mollifier mollifier =
        kind == ContactKind::edge_edge ? edge_mollifier(at, contacts.mollifier_threshold[k]) : Mollifier{};
    const Derivatives f = potential(s.distance, contacts.weight[k], contacts.dhat[k]);
    vectors.clear();
    stiffness.clear();
    const int count = pair_bending(at, s, f, mollifier, threshold, vectors, stiffness);
    for (int j = 0; j < count; ++j) found.add(contacts.nodes[k], vectors[j], stiffness[j]);
  }
  return found;
}

}  // namespace qlb
