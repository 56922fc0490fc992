// Names and colours of the body parts, in DensePose's order; 0 is the background.
#pragma once

#include <array>
#include <cstdint>

namespace maq {

struct BodyPart {
  const char* name;
  std::array<uint8_t, 3> rgb;
};

// So that a body can be read at a glance: torso gold, head rose, right limbs warm, left limbs cool; the front and the
// outer side of a limb are lighter than its back.
constexpr std::array<BodyPart, 25> kBodyParts = {{
    {"background", {0, 0, 0}},
    {"torso, back", {214, 158, 46}},
    {"torso, front", {246, 198, 82}},
    {"right hand", {255, 112, 67}},
    {"left hand", {64, 156, 255}},
    {"left foot", {46, 204, 187}},
    {"right foot", {232, 84, 128}},
    {"right upper leg, back", {196, 76, 60}},
    {"left upper leg, back", {44, 122, 160}},
    {"right upper leg, front", {236, 112, 88}},
    {"left upper leg, front", {72, 160, 200}},
    {"right lower leg, back", {170, 58, 84}},
    {"left lower leg, back", {28, 142, 132}},
    {"right lower leg, front", {216, 86, 112}},
    {"left lower leg, front", {60, 184, 168}},
    {"left upper arm, inside", {78, 110, 214}},
    {"right upper arm, inside", {216, 104, 40}},
    {"left upper arm, outside", {112, 146, 244}},
    {"right upper arm, outside", {246, 144, 70}},
    {"left lower arm, inside", {92, 84, 200}},
    {"right lower arm, inside", {228, 128, 28}},
    {"left lower arm, outside", {132, 120, 236}},
    {"right lower arm, outside", {252, 170, 60}},
    {"head, right", {236, 100, 150}},
    {"head, left", {250, 140, 178}},
}};

}  // namespace maq
