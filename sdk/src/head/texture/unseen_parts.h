// Fills the parts of a head that no photo shows: mirrors the other side, and continues hair from hair and skin from
// skin.
#pragma once

#include <cstdint>
#include <vector>

namespace maq::head {

// The surface of each texel; row by row.
struct Texels {
  std::vector<float> positions, normals, colours;  // [side][side][3]
  std::vector<uint8_t> is_surface, is_cap;         // [side][side]
};

struct Differences {
  std::vector<float> values;   // [side][side][3]: photo less mesh, 0 to 255
  std::vector<float> weights;  // [side][side]
};

// How much of each texel is hair, 0 to 1: what is within the hairline of most heads, unless it has the colour of the
// cheeks, and what has the colour of the top of the head. Without a difference between these the hairline decides.
std::vector<float> hair_fractions(const Texels& texels, int side);

// Fills an unknown side from the other side. A side that is known in part keeps its light: the mean difference between
// both sides goes on from there.
Differences mirrored(const Differences& known, const Texels& texels, int side);

// The differences that give each texel the mean colour that photos show of hair or of skin, as bright as the mesh's
// colour is among these.
std::vector<float> colours_of_classes(const Differences& known, const Texels& texels, const std::vector<float>& hair,
                                      int side);

// Makes differences go over into those of the nearest known texels, so that there is no step.
void go_on_from_known(const Differences& known, int side, std::vector<float>& values);

}  // namespace maq::head
