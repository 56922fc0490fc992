// The template head as a mesh with texture coordinates and facial actions. Plain data; files/ reads it and
// registration/ registers it to a head.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace maq::head {

inline constexpr size_t kMaxTemplatePoints = 65535;  // and vertices
inline constexpr size_t kMaxTemplateTriangles = 1 << 18, kMaxActions = 256;

// The kind of a point. The values are stored: new ones are added at the end.
enum class TemplateKind : uint8_t {
  kInside,  // of the skin behind the surface
  kSurface,
  kMouth,     // of the skin inside of the mouth
  kEye,       // of an eyeball, behind the lids
  kEyeFront,  // of an eyeball, where it is seen
  kTeeth,
  kTongue,
};

// How the face moves, at its strongest.
struct FacialAction {
  std::string name;              // letters, digits and _
  std::vector<uint32_t> points;  // that move, increasing
  std::vector<float> deltas;     // [points][3], dm
};

// A point with two texture coordinates is two vertices.
struct HeadTemplate {
  std::vector<float> points;  // [count][3], dm, in the template head's frame
  std::vector<TemplateKind> kinds;
  std::vector<uint32_t> vertex_points;     // of each vertex
  std::vector<float> texture_coordinates;  // [vertices][2]: u to the right, v down, 0 to 1
  std::vector<uint32_t> triangles;         // three vertices each, counter-clockwise seen from outside
  std::vector<FacialAction> actions;

  size_t point_count() const { return kinds.size(); }
};

// Returns the fault of a template ("it has 0 points, …"), or an empty text.
std::string template_fault(const HeadTemplate& head);

}  // namespace maq::head
