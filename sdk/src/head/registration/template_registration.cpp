#include "head/registration/template_registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/math/vec3.h"

namespace maq::head {
namespace {

constexpr int kSteps = 30, kLastSteps = 3;
constexpr double kMaxStep_dm = 0.08, kDamping = 0.7;
// How much the neighbours' displacement counts beside a point's own place, from the first step to the last.
constexpr double kFirstStiffness = 1, kLastStiffness = 0.02;
// With this residual of the template point, a point's own position has half of the weight.
constexpr double kTrustedResidual_dm = 0.06;
constexpr int kFollowSweeps = 200, kLetGoSweeps = 40, kLetGoRounds = 24;
// A point that is farther from the surface, or whose template point is off by more, did not find its place.
constexpr double kLostDistance_dm = 0.01, kLostResidual_dm = 0.3;
constexpr double kMinScale = 0.3, kMaxScale = 3;
constexpr double kReach_dm = 16;  // no point is farther
// Teeth and tongue are smaller than on the template: lips of fitted heads are flatter, and teeth would show through.
constexpr double kOfMouthParts = 0.92;

bool is_on_surface(TemplateKind kind) { return kind == TemplateKind::kSurface || kind == TemplateKind::kEyeFront; }
bool is_part(TemplateKind kind) { return kind >= TemplateKind::kEye; }

Vec3 triple_at(const std::vector<float>& values, size_t i) {
  return {double(values[3 * i]), double(values[3 * i + 1]), double(values[3 * i + 2])};
}

Vec3 within(Vec3 step, double limit) {
  const double size = length(step);
  return size > limit ? (limit / size) * step : step;
}

class Registration {
 public:
  Registration(const HeadTemplate& head, const std::vector<float>& starts, const RegistrationField& field)
      : head_(head), field_(field), count_(head.point_count()), at_(count_), trust_(count_), normals_(count_) {
    for (size_t i = 0; i < count_; ++i) {
      template_.push_back(triple_at(head.points, i));
      const Vec3 start = triple_at(starts, i);
      at_[i] = is_finite(start) && length(start) < kReach_dm ? start : template_[i];
      if (is_on_surface(head.kinds[i])) surface_.push_back(i);
    }
    for (const uint32_t corner : head.triangles) corners_.push_back(head.vertex_points[corner]);
    find_neighbours();
  }

  TemplateRegistration run() {
    for (int step = 0; step < kSteps; ++step) {
      const double stiffness =
          kFirstStiffness * std::pow(kLastStiffness / kFirstStiffness, double(step) / (kSteps - 1));
      evaluate_field();
      std::vector<Vec3> wanted = at_;
      for (const size_t i : surface_) wanted[i] = at_[i] + own_step(i);
      relax(wanted, stiffness);
    }
    settle();
    let_go();
    result_.scale = scale_of_face();
    follow(points_inside(), kFollowSweeps);
    move_parts();
    measure();
    for (const Vec3 p : at_) {
      for (const double value : {p.x, p.y, p.z}) result_.points.push_back(float(value));
    }
    return std::move(result_);
  }

 private:
  void find_neighbours() {
    std::vector<std::pair<uint32_t, uint32_t>> edges;
    for (size_t i = 0; i < corners_.size(); ++i) {
      const uint32_t a = corners_[i], b = corners_[i / 3 * 3 + (i + 1) % 3];
      if (a != b) edges.push_back({a, b}), edges.push_back({b, a});
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    first_.assign(count_ + 1, 0);
    for (const auto& edge : edges) ++first_[edge.first + 1], neighbours_.push_back(edge.second);
    for (size_t i = 0; i < count_; ++i) first_[i + 1] += first_[i];
  }

  // The field at all points.
  void evaluate_field() {
    std::array<std::vector<float>, 3> axes;
    for (auto& axis : axes) axis.resize(count_);
    for (size_t i = 0; i < count_; ++i) {
      axes[0][i] = float(at_[i].x), axes[1][i] = float(at_[i].y), axes[2][i] = float(at_[i].z);
    }
    values_.resize(kRegistrationValues * count_);
    field_(axes[0].data(), axes[1].data(), axes[2].data(), values_.data(), count_);
    for (size_t i = 0; i < count_; ++i) normals_[i] = normalized(value(i, 1));
  }

  Vec3 value(size_t i, size_t plane) const {
    return {double(values_[plane * count_ + i]), double(values_[(plane + 1) * count_ + i]),
            double(values_[(plane + 2) * count_ + i])};
  }
  double distance(size_t i) const { return double(values_[i]) / length(value(i, 1)); }
  Vec3 residual(size_t i) const { return template_[i] - value(i, 4); }

  // To the surface, and along it to the template point; sets how much it is to be trusted.
  Vec3 own_step(size_t i) {
    const Vec3 off = residual(i), n = normals_[i];
    const double to_surface = distance(i);
    trust_[i] = 0;
    if (!is_finite(off) || !is_finite(n) || !std::isfinite(to_surface)) return {};
    const double share = length(off) / kTrustedResidual_dm;
    trust_[i] = 1 / (1 + share * share);
    return std::clamp(-to_surface, -kMaxStep_dm, kMaxStep_dm) * n +
           within(kDamping * (off - dot(off, n) * n), kMaxStep_dm);
  }

  // One step of Jacobi's method: each of the points on the surface between its wanted place, by its trust, and where
  // the mean displacement of its neighbours there has it.
  void relax(const std::vector<Vec3>& wanted, double stiffness) {
    const std::vector<Vec3> before = at_;
    for (const size_t i : surface_) {
      Vec3 sum;
      double count = 0;
      for (size_t n = first_[i]; n < first_[i + 1]; ++n) {
        const size_t j = neighbours_[n];
        if (!is_on_surface(head_.kinds[j])) continue;
        sum = sum + (wanted[j] - template_[j]);
        ++count;
      }
      if (count == 0) {
        at_[i] = trust_[i] > 0 ? wanted[i] : before[i];
        continue;
      }
      const Vec3 held = template_[i] + (1 / count) * sum;
      at_[i] = (1 / (trust_[i] + stiffness)) * (trust_[i] * wanted[i] + stiffness * held);
    }
  }

  // Displaces points like the mean of their neighbours, by steps of Jacobi's method.
  void follow(const std::vector<size_t>& points, int sweeps) {
    std::vector<Vec3> made(points.size());
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (size_t k = 0; k < points.size(); ++k) {
        const size_t i = points[k];
        Vec3 sum;
        for (size_t n = first_[i]; n < first_[i + 1]; ++n) {
          sum = sum + (at_[neighbours_[n]] - template_[neighbours_[n]]);
        }
        const double count = double(first_[i + 1] - first_[i]);
        made[k] = count > 0 ? template_[i] + (1 / count) * sum : at_[i];
      }
      for (size_t k = 0; k < points.size(); ++k) at_[points[k]] = made[k];
    }
  }

  // Onto the surface, where it is near.
  void settle() {
    for (int step = 0; step < kLastSteps; ++step) {
      evaluate_field();
      for (const size_t i : surface_) {
        const double to_surface = distance(i);
        if (!is_finite(normals_[i]) || !(std::abs(to_surface) <= kMaxStep_dm)) continue;
        at_[i] = at_[i] - to_surface * normals_[i];
      }
    }
  }

  // Triangles of the skin that face another way than on the template.
  std::vector<size_t> flipped() const {
    std::vector<size_t> found;
    for (size_t t = 0; t < corners_.size(); t += 3) {
      const uint32_t a = corners_[t], b = corners_[t + 1], c = corners_[t + 2];
      if (!is_skin(a) || !is_skin(b) || !is_skin(c)) continue;
      const auto normal = [&](const std::vector<Vec3>& p) { return cross(p[b] - p[a], p[c] - p[a]); };
      if (dot(normal(at_), normal(template_)) < 0) found.push_back(t);
    }
    return found;
  }
  bool is_skin(size_t i) const { return head_.kinds[i] == TemplateKind::kSurface; }

  // Points without a good position, and points of flipped triangles, are let go: they follow their neighbours, together
  // with the skin inside, which would hold lips and lids in place. Where that is not enough, so do these.
  void let_go() {
    evaluate_field();
    std::vector<uint8_t> is_loose(count_);
    for (const size_t i : surface_) {
      is_loose[i] = !(std::abs(distance(i)) <= kLostDistance_dm) || !(length(residual(i)) <= kLostResidual_dm) ? 1 : 0;
    }
    for (int round = 0; round < kLetGoRounds; ++round) {
      const std::vector<size_t> wrong = flipped();
      if (round > 0 && wrong.empty()) return;
      std::vector<uint8_t> is_near(count_);
      for (const size_t t : wrong) {
        for (size_t k = 0; k < 3; ++k) is_near[corners_[t + k]] = 1;
      }
      for (int ring = 0; ring < round / 2; ++ring) {
        const std::vector<uint8_t> before = is_near;
        for (size_t i = 0; i < count_; ++i) {
          for (size_t n = first_[i]; before[i] != 0 && n < first_[i + 1]; ++n) is_near[neighbours_[n]] = 1;
        }
      }
      for (size_t i = 0; i < count_; ++i) is_loose[i] = uint8_t(is_loose[i] | is_near[i]);
      std::vector<size_t> loose = points_inside();
      for (const size_t i : surface_) {
        if (is_loose[i] != 0) loose.push_back(i);
      }
      follow(loose, kLetGoSweeps);
    }
  }

  // The scale of the points that actions move: hair does not count.
  double scale_of_face() const {
    std::vector<uint8_t> moves(count_);
    for (const FacialAction& action : head_.actions) {
      for (const uint32_t i : action.points) moves[i] = 1;
    }
    Vec3 middle[2];
    double count = 0, squares[2] = {};
    const auto each = [&](auto&& use) {
      for (const size_t i : surface_) {
        if (moves[i] != 0) use(i);
      }
    };
    each([&](size_t i) { middle[0] = middle[0] + template_[i], middle[1] = middle[1] + at_[i], ++count; });
    if (count == 0) return 1;
    each([&](size_t i) {
      const Vec3 from[2] = {template_[i] - (1 / count) * middle[0], at_[i] - (1 / count) * middle[1]};
      for (size_t k = 0; k < 2; ++k) squares[k] += dot(from[k], from[k]);
    });
    return squares[0] > 0 ? std::clamp(std::sqrt(squares[1] / squares[0]), kMinScale, kMaxScale) : 1;
  }

  std::vector<size_t> points_inside() const {
    std::vector<size_t> inside;
    for (size_t i = 0; i < count_; ++i) {
      if (!is_on_surface(head_.kinds[i]) && !is_part(head_.kinds[i])) inside.push_back(i);
    }
    return inside;
  }

  // Each piece that hangs together is scaled as the face is; it goes where its points on the surface went, else where
  // the surface around it did.
  void move_parts() {
    std::vector<uint8_t> is_done(count_);
    const std::vector<Vec3> registered = at_;
    const auto shift_of = [&](size_t i) { return registered[i] - result_.scale * template_[i]; };
    for (size_t start = 0; start < count_; ++start) {
      if (!is_part(head_.kinds[start]) || is_done[start] != 0) continue;
      std::vector<size_t> piece = {start};
      is_done[start] = 1;
      for (size_t k = 0; k < piece.size(); ++k) {
        for (size_t n = first_[piece[k]]; n < first_[piece[k] + 1]; ++n) {
          const size_t j = neighbours_[n];
          if (is_part(head_.kinds[j]) && is_done[j] == 0) is_done[j] = 1, piece.push_back(j);
        }
      }
      Vec3 middle, shift;
      double weights = 0;
      const auto add = [&](size_t i, double weight) {
        shift = shift + weight * shift_of(i);
        weights += weight;
      };
      for (const size_t i : piece) {
        middle = middle + (1 / double(piece.size())) * template_[i];
        if (head_.kinds[i] == TemplateKind::kEyeFront) add(i, 1);
      }
      if (weights == 0) {
        for (const size_t i : surface_) {
          const Vec3 away = template_[i] - middle;
          add(i, 1 / (1e-6 + dot(away, away) * dot(away, away)));
        }
      }
      const double share = head_.kinds[start] >= TemplateKind::kTeeth ? kOfMouthParts : 1;
      for (const size_t i : piece) {
        at_[i] =
            result_.scale * (middle + share * (template_[i] - middle)) + (weights > 0 ? (1 / weights) * shift : Vec3{});
      }
    }
  }

  void measure() {
    evaluate_field();
    result_.colours.resize(3 * count_);
    result_.template_points = head_.points;
    for (size_t i = 0; i < count_; ++i) {
      const bool is_found = is_on_surface(head_.kinds[i]) && length(residual(i)) <= kLostResidual_dm;
      for (size_t c = 0; c < 3; ++c) {
        result_.colours[3 * i + c] = values_[(7 + c) * count_ + i];
        if (is_found) result_.template_points[3 * i + c] = values_[(4 + c) * count_ + i];
      }
    }
    size_t count = 0;
    for (const size_t i : surface_) {
      const double off = std::abs(distance(i)), error = length(residual(i));
      if (!is_skin(i) || !std::isfinite(off) || !std::isfinite(error)) continue;
      ++count;
      result_.mean_distance += off, result_.max_distance = std::max(result_.max_distance, off);
      result_.mean_residual += error, result_.max_residual = std::max(result_.max_residual, error);
    }
    if (count > 0) result_.mean_distance /= double(count), result_.mean_residual /= double(count);
    result_.flipped = flipped().size();
  }

  const HeadTemplate& head_;
  const RegistrationField& field_;
  const size_t count_;
  std::vector<Vec3> template_, at_;
  std::vector<double> trust_;
  std::vector<Vec3> normals_;
  std::vector<size_t> surface_, first_;  // the neighbours of point i begin at first_[i]
  std::vector<uint32_t> corners_, neighbours_;
  std::vector<float> values_;
  TemplateRegistration result_;
};

}  // namespace

TemplateRegistration register_template(const HeadTemplate& head, const std::vector<float>& starts,
                                       const RegistrationField& field) {
  return Registration(head, starts, field).run();
}

}  // namespace maq::head
