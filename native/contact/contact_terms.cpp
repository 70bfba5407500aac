#include "contact/contact_terms.hpp"

#include <algorithm>
#include <stdexcept>

namespace qlb {

void add_normal_terms(const ContactSet& contacts, RankOneTerms& terms) {
  for (std::int64_t k = 0; k < contacts.size(); ++k)
    terms.add(contacts.nodes[k], contacts.gamma[k], contacts.normal[k], contacts.stiffness[k]);
}

void add_friction_terms(const FrictionTerms& friction, double along, std::span<const double> secant,
                        RankOneTerms& terms) {
  const std::size_t contacts = friction.stiffness.size() / 2;
  if (!secant.empty() && secant.size() != contacts) throw std::invalid_argument("secant: of other contacts");
  for (std::size_t k = 0; k < contacts; ++k) {
    const double across = friction.stiffness[2 * k + 1];
    double stiffness = std::max(friction.stiffness[2 * k], along * across);
    if (!secant.empty()) stiffness = std::max(stiffness, std::min(secant[k], across));
    terms.add(friction.nodes[2 * k], friction.gamma[2 * k], friction.axis[2 * k], stiffness);
    terms.add(friction.nodes[2 * k + 1], friction.gamma[2 * k + 1], friction.axis[2 * k + 1], across);
  }
}

}  // namespace qlb
