#include "contact/barrier.hpp"

#include <nanobind/stl/optional.h>

#include "bindings/bindings.hpp"
#include "bindings/rows.hpp"
#include "contact/contact_terms.hpp"
#include "contact/friction.hpp"

namespace qlb {
namespace {

template <class T>
std::span<const T> view_or_none(const std::optional<Array<const T>>& array) {
  return array ? view(*array) : std::span<const T>();
}

// Adds the property `name`: the vector that `member` points at.
template <class Class, class Owner, class T>
void property(Class& type, const char* name, std::vector<T> Owner::* member) {
  type.def_prop_ro(name, [member](const Owner& o) { return entries(o.*member); }, nb::rv_policy::reference_internal);
}
template <class Class, class Owner, class T, std::size_t width>
void property(Class& type, const char* name, std::vector<std::array<T, width>> Owner::* member) {
  type.def_prop_ro(name, [member](const Owner& o) { return rows(o.*member); }, nb::rv_policy::reference_internal);
}

void bind_contact_set(nb::module_& m) {
  nb::class_<ContactSet> set(m, "ContactSet",
                             "The contacts of one configuration, one entry of each array per contact.");
  set.def_ro("energy", &ContactSet::energy, "scaled; infinite where something touches")
      .def_ro("minimum_distance", &ContactSet::minimum_distance, "[m]; infinite where there is no contact")
      .def_prop_ro("size", &ContactSet::size);
  property(set, "nodes", &ContactSet::nodes);
  property(set, "gamma", &ContactSet::gamma);
  property(set, "normal", &ContactSet::normal);
  property(set, "distance", &ContactSet::distance);
  property(set, "force", &ContactSet::force);
  property(set, "stiffness", &ContactSet::stiffness);
  property(set, "dhat", &ContactSet::dhat);
  property(set, "key", &ContactSet::key);
  property(set, "groups", &ContactSet::groups);
}

ContactSet evaluate(const Barrier& b, const Array<const double>& x, const Array<const std::int32_t>& vertex_faces,
                    const Array<const std::int32_t>& edge_edges, const Array<const double>& planes,
                    const Array<const std::uint8_t>& plane_allowed, double scale, const Array<double>& gradient,
                    const std::optional<Array<const std::int8_t>>& edge_sign) {
  const std::int64_t size = 3 * b.surface().nodes();
  return b.evaluate(sized(x, size, "x"), {view(vertex_faces), view(edge_edges), view_or_none(edge_sign)},
                    {view(planes), view(plane_allowed)}, scale, sized(gradient, size, "gradient"));
}

nb::ndarray<nb::numpy, double, nb::shape<-1, 12, 12>> hessian_blocks(const Barrier& b, const Array<const double>& x,
                                                                     const ContactSet& contacts, bool project) {
  const double* at = sized(x, 3 * b.surface().nodes(), "x");
  const auto size = static_cast<std::size_t>(contacts.size());
  auto* blocks = new double[144 * size];
  nb::capsule owner(blocks, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  {
    nb::gil_scoped_release release;
    b.hessian_blocks(at, contacts, project, blocks);
  }
  return {blocks, {size, 12, 12}, owner};
}

void bind_potential(nb::module_& m) {
  nb::class_<Barrier>(m, "Barrier", "The potential of contact: a barrier, or a penalty where states may intersect.")
      .def(
          "__init__",
          [](Barrier* self, std::shared_ptr<ContactSurface> surface, double dhat, double stiffness, int threads,
             const std::string& kind) { new (self) Barrier(std::move(surface), dhat, stiffness, threads, kind); },
          nb::arg("surface"), nb::arg("dhat"), nb::arg("stiffness"), nb::arg("threads"), nb::arg("kind") = "barrier")
      .def(
          "limit_pairs",
          [](Barrier& b, const Array<const std::int64_t>& keys, const Array<const double>& dhat) {
            b.limit_pairs(view(keys), view(dhat));
          },
          nb::arg("keys"), nb::arg("dhat"), "Pairs that act only when nearer than a distance of their own.")
      .def_prop_ro("reach", &Barrier::reach, "Pairs farther apart, or for a penalty deeper inside, do not act [m].")
      .def("evaluate", &evaluate, nb::arg("x"), nb::arg("vertex_faces"), nb::arg("edge_edges"), nb::arg("planes"),
           nb::arg("plane_allowed"), nb::arg("scale"), nb::arg("gradient").noconvert(),
           nb::arg("edge_sign") = nb::none(), ReleaseGil(),
           "The contacts at x (n, 3) [m] among the pairs vertex_faces (k, 2) [node, face] and edge_edges (l, 2) and "
           "between all vertices and the planes (q, 4) [unit normal, offset] that hold out their groups "
           "(plane_allowed (q, groups)). Adds scale times the gradient of the energy to gradient (n, 3). "
           "edge_sign (l) int8, for a penalty: -1 where two edges have passed through each other.")
      .def(
          "bending",
          [](const Barrier& b, const Array<const double>& x, const ContactSet& contacts, double threshold) {
            return b.bending(sized(x, 3 * b.surface().nodes(), "x"), contacts, threshold);
          },
          nb::arg("x"), nb::arg("contacts"), nb::arg("threshold"), ReleaseGil(),
          "Terms of the Hessian of contacts besides the normal ones, as far as they stiffen by more than `threshold`.")
      .def("hessian_blocks", &hessian_blocks, nb::arg("x"), nb::arg("contacts"), nb::arg("project"),
           "The Hessian of each contact (size, 12, 12) at the x where `contacts` were found, scaled as they are. "
           "project: to the nearest positive semidefinite matrices.");
}

void bind_friction(nb::module_& m) {
  nb::class_<FrictionTerms> terms(m, "FrictionTerms",
                                  "Friction's energy and its Hessian, two rank-one terms a contact.");
  terms.def_ro("energy", &FrictionTerms::energy);
  property(terms, "nodes", &FrictionTerms::nodes);
  property(terms, "gamma", &FrictionTerms::gamma);
  property(terms, "axis", &FrictionTerms::axis);
  property(terms, "stiffness", &FrictionTerms::stiffness);
  property(terms, "slip", &FrictionTerms::slip);
  terms.def(
      "secant", [](const FrictionTerms& now, const FrictionTerms& before) { return numpy(now.secant(before)); },
      nb::arg("before"),
      "By how much each friction has grown along the change of its slip since `before`, over that change (k,); 0 where "
      "that is none.");

  nb::class_<Friction>(m, "Friction", "Smooth Coulomb friction with lagged normal forces.")
      .def(
          "__init__",
          [](Friction* self, const Array<const std::int32_t>& nodes, const Array<const double>& gamma,
             const Array<const double>& normal, const Array<const double>& normal_force, const Array<const double>& mu,
             const std::optional<Array<const double>>& slip) {
            new (self)
                Friction(view(nodes), view(gamma), view(normal), view(normal_force), view(mu), view_or_none(slip));
          },
          nb::arg("nodes"), nb::arg("gamma"), nb::arg("normal"), nb::arg("normal_force"), nb::arg("mu"),
          nb::arg("slip") = nb::none())
      .def_prop_ro("size", &Friction::size)
      .def(
          "evaluate",
          [](const Friction& f, const Array<const double>& x, const Array<const double>& x_base, double epsilon,
             double scale, const Array<double>& gradient) {
            const auto size = static_cast<std::int64_t>(x.size());
            return f.evaluate(x.data(), sized(x_base, size, "x_base"), size / 3, epsilon, scale,
                              sized(gradient, size, "gradient"));
          },
          nb::arg("x"), nb::arg("x_base"), nb::arg("epsilon"), nb::arg("scale"), nb::arg("gradient").noconvert(),
          ReleaseGil(),
          "The friction of slips from x_base to x (n, 3) [m]; below the slip epsilon [m] it holds. Adds scale times "
          "the gradient of the energy to gradient (n, 3).");
}

RankOneTerms contact_terms(const ContactSet* contacts, const FrictionTerms* friction, double along,
                           const std::optional<Array<const double>>& secant, const RankOneTerms* more) {
  RankOneTerms terms;
  terms.reserve((contacts != nullptr ? contacts->size() : 0) +
                (friction != nullptr ? static_cast<std::int64_t>(friction->stiffness.size()) : 0) +
                (more != nullptr ? more->size() : 0));
  if (contacts != nullptr) add_normal_terms(*contacts, terms);
  if (friction != nullptr) add_friction_terms(*friction, along, view_or_none(secant), terms);
  if (more != nullptr) terms.add(*more);
  return terms;
}

}  // namespace

void bind_barrier(nb::module_& m) {
  bind_contact_set(m);
  bind_potential(m);
  bind_friction(m);
  m.def(
      "contact_terms", &contact_terms, nb::arg("contacts").none(), nb::arg("friction").none(), nb::arg("along"),
      nb::arg("secant") = nb::none(), nb::arg("more").none() = nb::none(), ReleaseGil(),
      "The Hessian of contacts along their normals, then that of friction, two terms each, then `more`. Along its slip "
      "friction has at least the share `along` of its stiffness across, and at least `secant` (f), no more than "
      "across.");
}

}  // namespace qlb
