#include "head/registration/template_joints.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace maq::head {
namespace {

// On the template head (dm): the neck's middle at the cut, and the upper end of the spine, at the height of the lobes.
constexpr Vec3 kNeck{0, 0.22, -1.53}, kSpineEnd{0, 0.1, -0.55};
// The neck bends along this direction: the throat turns before the nape. From the first length (dm) above the neck's
// middle on the head turns a point, from the second wholly.
constexpr Vec3 kBend{0, -0.33, 0.944};
constexpr double kFirstBend_dm = 0.2, kWholeBend_dm = 0.85;
constexpr double kMinJawTurn_rad = 0.05;
// Moves of jawOpen that are smaller than this say little of how far a point follows the jaw.
constexpr double kClearMove_dm = 0.02;

Vec3 triple_of(const std::vector<float>& values, size_t i) {
  return {double(values[3 * i]), double(values[3 * i + 1]), double(values[3 * i + 2])};
}

// A turn about an axis from left to right.
struct JawTurn {
  double y = 0, z = 0;  // of the axis
  double cosine = 1, sine = 0;

  Vec3 move(Vec3 p) const {
    const double dy = p.y - y, dz = p.z - z;
    return {0, cosine * dy - sine * dz - dy, sine * dy + cosine * dz - dz};
  }
};

// The turn that is nearest to the moves of an action's points, of one kind or of all (Kabsch's method in the plane).
std::optional<JawTurn> jaw_turn(const HeadTemplate& head, const FacialAction& action,
                                const std::optional<TemplateKind>& kind) {
  const auto each = [&](auto&& use) {
    for (size_t k = 0; k < action.points.size(); ++k) {
      const size_t i = action.points[k];
      if (!kind || head.kinds[i] == *kind) use(triple_of(head.points, i), triple_of(action.deltas, k));
    }
  };
  Vec3 before, after;
  double count = 0;
  each([&](Vec3 p, Vec3 move) { before = before + p, after = after + p + move, ++count; });
  if (count < 3) return std::nullopt;
  before = (1 / count) * before, after = (1 / count) * after;
  double along = 0, across = 0;
  each([&](Vec3 p, Vec3 move) {
    const Vec3 from = p - before, to = p + move - after;
    along += from.y * to.y + from.z * to.z, across += from.y * to.z - from.z * to.y;
  });
  const double angle = std::atan2(across, along);
  if (!(std::abs(angle) >= kMinJawTurn_rad && std::abs(angle) < 1.5)) return std::nullopt;
  JawTurn turn;
  turn.cosine = std::cos(angle), turn.sine = std::sin(angle);
  // after = R before + t, and the axis stays: (1 - R) axis = t.
  const double ty = after.y - (turn.cosine * before.y - turn.sine * before.z);
  const double tz = after.z - (turn.sine * before.y + turn.cosine * before.z);
  const double half_cotangent = 0.5 / std::tan(angle / 2);
  turn.y = 0.5 * ty - half_cotangent * tz, turn.z = half_cotangent * ty + 0.5 * tz;
  return turn;
}

class JointMaker {
 public:
  JointMaker(const HeadTemplate& head, const TemplateRegistration& registration)
      : head_(head), registration_(registration) {}

  TemplateJoints make() {
    made_.weights.resize(head_.point_count());
    made_.joints = {{"Neck", -1, on_head(kNeck)}, {"Head", 0, on_head(kSpineEnd)}};
    const double size = length(kBend);
    for (size_t i = 0; i < head_.point_count(); ++i) {
      const double above = dot(triple_of(head_.points, i) - kNeck, kBend) / size;
      const double t = std::clamp((above - kFirstBend_dm) / (kWholeBend_dm - kFirstBend_dm), 0.0, 1.0);
      const auto turned = float(t * t * (3 - 2 * t));
      made_.weights[i] = {1 - turned, turned};
    }
    add_jaw();
    add_eye("LeftEye", 1);
    add_eye("RightEye", -1);
    return std::move(made_);
  }

 private:
  // Where a point of the template head lies on the head: as the surface around it.
  Vec3 on_head(Vec3 point) const {
    Vec3 shift;
    double weights = 0;
    for (size_t i = 0; i < head_.point_count(); ++i) {
      if (head_.kinds[i] != TemplateKind::kSurface) continue;
      const Vec3 own = triple_of(head_.points, i), away = own - point;
      const double weight = 1 / (1e-3 + dot(away, away) * dot(away, away));
      shift = shift + weight * (triple_of(registration_.points, i) - registration_.scale * own);
      weights += weight;
    }
    return registration_.scale * point + (weights > 0 ? (1 / weights) * shift : Vec3{});
  }

  void add_jaw() {
    const auto action = std::find_if(head_.actions.begin(), head_.actions.end(),
                                     [](const FacialAction& one) { return one.name == "jawOpen"; });
    if (action == head_.actions.end()) return;
    std::optional<JawTurn> turn = jaw_turn(head_, *action, TemplateKind::kTeeth);
    if (!turn) turn = jaw_turn(head_, *action, std::nullopt);
    if (!turn) return;
    const size_t jaw = made_.joints.size();
    made_.joints.push_back({"Jaw", 1, on_head({0, turn->y, turn->z})});
    for (size_t k = 0; k < action->points.size(); ++k) {
      const size_t i = action->points[k];
      const Vec3 wholly = turn->move(triple_of(head_.points, i));
      const double share =
          dot(triple_of(action->deltas, k), wholly) / (dot(wholly, wholly) + kClearMove_dm * kClearMove_dm);
      const auto weight = float(std::clamp(share, 0.0, 1.0));
      std::array<float, 5>& of_point = made_.weights[i];
      of_point[0] *= 1 - weight, of_point[1] *= 1 - weight, of_point[jaw] = weight;
    }
  }

  // `side`: 1 for the person's left, -1 for the right.
  void add_eye(const char* name, float side) {
    Vec3 low, high;
    bool is_first = true;
    std::vector<size_t> eyeball;
    for (size_t i = 0; i < head_.point_count(); ++i) {
      const bool is_eye = head_.kinds[i] == TemplateKind::kEye || head_.kinds[i] == TemplateKind::kEyeFront;
      if (!is_eye || !(side * head_.points[3 * i] > 0)) continue;
      const Vec3 p = triple_of(registration_.points, i);
      low = is_first ? p : Vec3{std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = is_first ? p : Vec3{std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      is_first = false;
      eyeball.push_back(i);
    }
    if (eyeball.empty()) return;
    // A ball, with the cornea before it.
    const Vec3 middle{(low.x + high.x) / 2, high.y - (high.z - low.z) / 2, (low.z + high.z) / 2};
    const size_t joint = made_.joints.size();
    made_.joints.push_back({name, 1, middle});
    for (const size_t i : eyeball) made_.weights[i] = {}, made_.weights[i][joint] = 1;
  }

  const HeadTemplate& head_;
  const TemplateRegistration& registration_;
  TemplateJoints made_;
};

}  // namespace

TemplateJoints template_joints(const HeadTemplate& head, const TemplateRegistration& registration) {
  return JointMaker(head, registration).make();
}

}  // namespace maq::head
