#include "head/registration/visemes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

namespace maq::head {
namespace {

// The facial actions of visemes; Stretch is of both sides, and so on.
constexpr std::array<const char*, 10> kOfVisemes = {"jawOpen",        "mouthFunnel",   "mouthPucker", "mouthRollLower",
                                                    "mouthRollUpper", "tongueOut",     "mouthPress",  "mouthStretch",
                                                    "mouthUpperUp",   "mouthLowerDown"};
constexpr size_t kFirstOfBothSides = 6;

struct Viseme {
  const char* name;
  std::array<float, kOfVisemes.size()> weights;
};

// By the mouth's form in speech: closed lips, lips at the teeth, tongue between the teeth, and so on to the vowels.
constexpr std::array<Viseme, 15> kVisemes = {{
    // jaw, funnel, pucker, roll lower, upper, tongue, press, stretch, up, down
    {"viseme_sil", {}},
    {"viseme_PP", {0, 0, 0.1f, 0.3f, 0.3f, 0, 0.7f, 0, 0, 0}},
    {"viseme_FF", {0.08f, 0, 0, 0.7f, 0, 0, 0, 0.1f, 0.3f, 0}},
    {"viseme_TH", {0.15f, 0, 0, 0, 0, 0.35f, 0, 0.1f, 0.1f, 0.2f}},
    {"viseme_DD", {0.12f, 0, 0, 0, 0, 0, 0, 0.15f, 0.15f, 0.3f}},
    {"viseme_kk", {0.18f, 0, 0, 0, 0, 0, 0, 0.15f, 0.1f, 0.2f}},
    {"viseme_CH", {0.1f, 0.5f, 0.2f, 0, 0, 0, 0, 0, 0.2f, 0.2f}},
    {"viseme_SS", {0.05f, 0, 0, 0, 0, 0, 0, 0.35f, 0.2f, 0.35f}},
    {"viseme_nn", {0.1f, 0, 0, 0, 0, 0, 0, 0.1f, 0.05f, 0.2f}},
    {"viseme_RR", {0.12f, 0.35f, 0.2f, 0, 0, 0, 0, 0, 0, 0.1f}},
    {"viseme_aa", {0.6f, 0, 0, 0, 0, 0, 0, 0, 0.15f, 0.25f}},
    {"viseme_E", {0.3f, 0, 0, 0, 0, 0, 0, 0.4f, 0.1f, 0.25f}},
    {"viseme_I", {0.15f, 0, 0, 0, 0, 0, 0, 0.5f, 0.15f, 0.25f}},
    {"viseme_O", {0.4f, 0.55f, 0.15f, 0, 0, 0, 0, 0, 0, 0}},
    {"viseme_U", {0.15f, 0.35f, 0.75f, 0, 0, 0, 0, 0, 0, 0}},
}};

const FacialAction* find_action(const HeadTemplate& head, const std::string& name) {
  const auto found = std::find_if(head.actions.begin(), head.actions.end(),
                                  [&](const FacialAction& action) { return action.name == name; });
  return found == head.actions.end() ? nullptr : &*found;
}

}  // namespace

std::vector<FacialAction> visemes_of(const HeadTemplate& head) {
  std::array<std::vector<const FacialAction*>, kOfVisemes.size()> parts;
  for (size_t k = 0; k < parts.size(); ++k) {
    const std::string name = kOfVisemes[k];
    if (k < kFirstOfBothSides) {
      parts[k] = {find_action(head, name)};
    } else {
      parts[k] = {find_action(head, name + "Left"), find_action(head, name + "Right")};
    }
    if (std::find(parts[k].begin(), parts[k].end(), nullptr) != parts[k].end()) return {};
  }
  std::vector<FacialAction> made;
  for (const Viseme& viseme : kVisemes) {
    std::vector<float> moves(3 * head.point_count());
    std::vector<uint8_t> is_moved(head.point_count());
    for (size_t k = 0; k < parts.size(); ++k) {
      if (viseme.weights[k] == 0) continue;
      for (const FacialAction* part : parts[k]) {
        for (size_t i = 0; i < part->points.size(); ++i) {
          is_moved[part->points[i]] = 1;
          for (size_t axis = 0; axis < 3; ++axis) {
            moves[3 * size_t(part->points[i]) + axis] += viseme.weights[k] * part->deltas[3 * i + axis];
          }
        }
      }
    }
    FacialAction action;
    action.name = viseme.name;
    for (size_t i = 0; i < head.point_count(); ++i) {
      if (is_moved[i] == 0) continue;
      action.points.push_back(uint32_t(i));
      action.deltas.insert(action.deltas.end(), &moves[3 * i], &moves[3 * i] + 3);
    }
    made.push_back(std::move(action));
  }
  return made;
}

}  // namespace maq::head
