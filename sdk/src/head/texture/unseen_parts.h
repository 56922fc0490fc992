// What no photo shows of a head: mirrored from the other side, and continued from what is seen, hair from hair and skin
// from skin.
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

// How much of each texel is hair, by where its colour lies between the colours of the face and of the back of the head;
// all 0 where these differ little, as on a bald head.
std::vector<float> hair_shares(const Texels& texels, int side);

// Fills an unknown side from the other side. A side that is known in part keeps its light: the mean difference between
// both sides goes on from there.
Differences mirrored(const Differences& known, const Texels& texels, int side);

// The differences that give each texel the mean colour that photos show of hair or of skin, as bright as the mesh's
// colour is among these.
std::vector<float> colours_of_classes(const Differences& known, const Texels& texels, const std::vector<float>& hair);

// Makes differences go over into those of the nearest known texels, so that there is no step.
void go_on_from_known(const Differences& known, int side, std::vector<float>& values);

}  // namespace maq::head
