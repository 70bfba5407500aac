// By what the terms of contacts differ from those that a factor holds.
#pragma once

#include <cstdint>
#include <span>

#include "linalg/rank_one_terms.hpp"
#include "linalg/woodbury_inverse.hpp"

namespace qlb {

// A sum of k a a^T: of contacts along their normals, then of friction, two a contact, then any others.
struct ContactTerms {
  std::span<const std::int64_t> keys, sliding;  // pairs of primitives, each once: of contacts, and of friction
  const RankOneTerms& terms;
};

// When stiffness is near enough: within a factor `same`, or different by no more than `small`, in parts of `scale`.
struct Nearness {
  double small, same;
};

// Of `levels`, from fine to coarse, the first counts that leaves at most `most` terms, else the last. As the same count
// normals that turn by less than the stiffness of the bodies, `scale`, would see, and friction whose weights of nodes
// have a squared change of `shifted`.
struct Comparing {
  double scale, shifted;
  std::span<const Nearness> levels;
  std::int64_t most;
};

struct ContactChange {
  RankOneTerms terms;       // those of now, with the stiffness that goes beside the factor; then the others
  std::int64_t framed = 0;  // how many others: in the frame of the factor, negative where it has too much
};

// `held`: in the frame of the factor that `inverse` is over, its keys and sliding ascending.
ContactChange contact_change(const ContactTerms& now, const ContactTerms& held, const WoodburyInverse& inverse,
                             const Comparing& by);

}  // namespace qlb
