// The Hessian of contacts and of friction as a sum of rank-one terms.
#pragma once

#include <span>

#include "contact/contact_set.hpp"
#include "contact/friction.hpp"
#include "linalg/rank_one_terms.hpp"

namespace qlb {

// Adds the terms along the normals, one a contact.
void add_normal_terms(const ContactSet& contacts, RankOneTerms& terms);

// Adds the terms of friction, two a contact: across the slip as it is; along it at least the share `along` of that, and
// at least what `secant`, where it is given, says of the contact, but no more than across.
void add_friction_terms(const FrictionTerms& friction, double along, std::span<const double> secant,
                        RankOneTerms& terms);

}  // namespace qlb
