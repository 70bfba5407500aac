// The contacts of one configuration: pairs (and nodes at planes) nearer than dhat.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace qlb {

enum class ContactKind : std::int64_t { vertex_face, edge_edge, plane };

inline constexpr int kKeyBits = 30;  // of a primitive's index in a key

inline std::int64_t contact_key(ContactKind kind, std::int64_t first, std::int64_t second) {
  return (static_cast<std::int64_t>(kind) << (2 * kKeyBits)) | (first << kKeyBits) | second;
}

// One entry of each array per contact. The gradient of a distance is gamma_i n at node i.
struct ContactSet {
  std::vector<std::array<std::int32_t, 4>> nodes;
  std::vector<std::array<double, 4>> gamma;
  std::vector<std::array<double, 3>> normal;
  std::vector<double> distance;          // [m]
  std::vector<double> force, stiffness;  // -scale dE/dd >= 0 and scale d2E/dd2 >= 0
  std::vector<std::int64_t> key;         // one per pair of primitives, the same in every configuration
  std::vector<std::array<std::int32_t, 2>> groups;
  std::vector<double> dhat;                 // distance below which it acts [m]
  std::vector<double> weight;               // scale times the area [m^2]
  std::vector<double> mollifier_threshold;  // eps [m^4] of two edges, else 0
  std::vector<std::int8_t> sign;            // of the distance of two edges, else 1
  double energy = 0.0;                      // scaled; infinite where something touches
  double minimum_distance = std::numeric_limits<double>::infinity();

  std::int64_t size() const { return static_cast<std::int64_t>(key.size()); }
  ContactKind kind(std::int64_t k) const { return static_cast<ContactKind>(key[k] >> (2 * kKeyBits)); }
};

}  // namespace qlb
