// The potential of contact: A kappa dhat beta(d / dhat) for each pair at distance d < dhat, kappa [Pa], A [m^2].
//
// The barrier is that of Li et al. 2020, "Incremental Potential Contact", with the areas of Li et al. 2023, "Convergent
// Incremental Potential Contact". A penalty takes its place where states may intersect.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/potentials.hpp"
#include "contact/separation.hpp"
#include "contact/surface.hpp"
#include "linalg/rank_one_terms.hpp"

namespace qlb {

// Pairs that may be in contact. Those of faces are (node, face), those of edges (edge, edge).
struct CandidatePairs {
  std::span<const std::int32_t> vertex_faces, edge_edges;
  std::span<const std::int8_t> edge_sign;  // one per pair of edges, or none: all 1
};

// Half spaces n.x >= offset, n of unit length, and the groups that each holds out.
struct Planes {
  std::span<const double> planes;         // (q, 4): n, offset
  std::span<const std::uint8_t> allowed;  // (q, groups)

  std::int64_t size() const { return static_cast<std::int64_t>(planes.size()) / 4; }
};

class Barrier {
 public:
  // kind: "barrier" or "penalty". dhat [m], stiffness [Pa].
  Barrier(std::shared_ptr<const ContactSurface> surface, double dhat, double stiffness, int threads,
          const std::string& kind);

  // Pairs that act only when nearer than a distance of their own below dhat: parts of one body that are near each other
  // at rest. Keys as in ContactSet.
  void limit_pairs(std::span<const std::int64_t> keys, std::span<const double> dhat);

  // Adds scale times the gradient of the energy to `gradient` (nodes, 3).
  ContactSet evaluate(const double* x, const CandidatePairs& candidates, const Planes& planes, double scale,
                      double* gradient) const;

  // The Hessian of each contact's energy, scaled as in `contacts`: blocks (size, 12, 12), row 3i + c for component c of
  // node i. project: to the nearest positive semidefinite matrix.
  void hessian_blocks(const double* x, const ContactSet& contacts, bool project, double* blocks) const;

  // What the Hessian of contacts has besides stiffness n n^T, as far as it stiffens by more than `threshold`: the sum
  // of k a a^T over terms.
  RankOneTerms bending(const double* x, const ContactSet& contacts, double threshold) const;

  double reach() const { return reach_; }  // a pair farther apart, or inside by more, does not act [m]
  const ContactSurface& surface() const { return *surface_; }

 private:
  struct Contact;
  void check(const CandidatePairs& candidates, const Planes& planes) const;
  Separation separation(ContactKind kind, const std::array<Vec3, 4>& x, double sign) const;
  bool in_reach(double distance, double dhat) const { return distance < dhat && (!penalty_ || distance > -reach_); }
  Derivatives potential(double distance, double weight, double dhat) const;
  double dhat_of(std::int64_t key) const;
  void keep_near(const std::array<Vec3, 4>& at, Contact&& contact, std::vector<Contact>& found) const;
  void vertex_face(const double* x, const std::int32_t* candidate, double scale, std::vector<Contact>& found) const;
  void edge_edge(const double* x, const std::int32_t* candidate, std::int8_t sign, double scale,
                 std::vector<Contact>& found) const;
  void vertex_planes(const double* x, std::int32_t node, const Planes& planes, double scale,
                     std::vector<Contact>& found) const;

  std::shared_ptr<const ContactSurface> surface_;
  double dhat_, stiffness_;
  std::vector<std::pair<std::int64_t, double>> limited_;  // key and dhat, ascending
  int threads_;
  bool penalty_;
  double reach_;  // a pair farther apart is no contact; nor is one that much inside
};

}  // namespace qlb
