#include "head/head_template.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "head/head_prior.h"

namespace maq::head {
namespace {

bool are_below(const std::vector<uint32_t>& values, size_t limit) {
  return std::all_of(values.begin(), values.end(), [&](uint32_t value) { return value < limit; });
}

bool are_near(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::abs(v) <= 2 * kMaxHeadExtent_dm; });
}

// So that names need no escapes in files.
bool is_plain_name(const std::string& name) {
  constexpr char kPlain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
  return !name.empty() && name.size() <= kMaxLandmarkName && name.find_first_not_of(kPlain) == std::string::npos;
}

bool is_within(const FacialAction& action, size_t points) {
  const bool increases =
      std::adjacent_find(action.points.begin(), action.points.end(), std::greater_equal<>()) == action.points.end();
  return increases && are_below(action.points, points) && action.deltas.size() == 3 * action.points.size() &&
         are_near(action.deltas);
}

}  // namespace

std::string template_fault(const HeadTemplate& head) {
  const size_t points = head.point_count(), vertices = head.vertex_points.size();
  if (points < 3 || points > kMaxTemplatePoints || vertices < 3 || vertices > kMaxTemplatePoints ||
      head.triangles.empty() || head.triangles.size() > 3 * kMaxTemplateTriangles) {
    return concatenate("it has ", points, " points, ", vertices, " vertices and ", head.triangles.size() / 3,
                       " triangles, but must have 3 to ", kMaxTemplatePoints, " of each, or 1 to ",
                       kMaxTemplateTriangles, " triangles");
  }
  if (head.points.size() != 3 * points || head.texture_coordinates.size() != 2 * vertices ||
      head.triangles.size() % 3 != 0) {
    return "its arrays are not of one size";
  }
  if (!are_near(head.points)) return "one of its points is not finite, or far away";
  if (std::any_of(head.kinds.begin(), head.kinds.end(), [](TemplateKind k) { return k > TemplateKind::kTongue; })) {
    return "one of its points is of a kind that there is not";
  }
  if (!are_below(head.vertex_points, points) || !are_below(head.triangles, vertices)) {
    return "one of its triangles has a point that it does not have";
  }
  if (!std::all_of(head.texture_coordinates.begin(), head.texture_coordinates.end(),
                   [](float value) { return value >= 0 && value <= 1; })) {
    return "one of its texture coordinates is not within 0 to 1";
  }
  if (head.actions.size() > kMaxActions) {
    return concatenate("it has ", head.actions.size(), " facial actions, but may have ", kMaxActions);
  }
  std::set<std::string> names;
  for (const FacialAction& action : head.actions) {
    if (!is_plain_name(action.name)) return "one of its facial actions has a name that is not of letters and digits";
    if (!names.insert(action.name).second) return concatenate("two of its facial actions are named ", action.name);
    if (!is_within(action, points)) {
      return concatenate("its facial action ", action.name, " moves points that it does not have, or too far");
    }
  }
  return "";
}

}  // namespace maq::head
