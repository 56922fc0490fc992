// The bytes of a scene file (.maqs). Numbers are little-endian, as on every machine that the SDK runs on.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/rounding.h"
#include "scene/format/scene.h"

namespace maq {

inline constexpr char kSceneFileMagic[8] = {'M', 'A', 'Q', 'S', 'C', 'N', '\r', '\n'};
inline constexpr uint32_t kSceneFileVersion = 1;
inline constexpr uint64_t kSceneFileAlignment = 64;

// In this order, one behind the other, each at a multiple of 64 bytes and filled up to one with zeros.
enum SceneFileSection {
  kBlocksSection,        // SceneBlock [blocks]
  kPlacesSection,        // as Scene::places
  kMeansSection,         // as Scene::means
  kSlopesSection,        // as Scene::slopes
  kStatePlacesSection,   // float [3][state_points]: x of all, then y, then z, relative to state_origin
  kStateSeenSection,     // uint32 [state_seen]: indices of points that some photo saw, rising or not, each once
  kStateMomentsSection,  // ViewMoments [state_seen]
  kSceneFileSections
};

struct SceneFileSpan {
  uint64_t offset;  // from the start of the file
  uint64_t bytes;   // without the zeros that fill it up
  uint64_t check;   // 64-bit XXH3 of it and those zeros
};

struct SceneFileHead {
  char magic[8];
  uint32_t version;
  uint32_t head_bytes;  // of this struct
  uint64_t head_check;  // 64-bit XXH3 of what follows in this struct
  uint64_t file_bytes;
  double origin[3], up[3];
  uint32_t points, varying, blocks;
  uint8_t place_kind, coefficient_kind;
  uint8_t zero[2];
  uint8_t networks_sha256[32];
  uint32_t state_points, state_seen;  // 0: no state of modelling
  double state_origin[3];
  uint32_t state_photos;  // how many were added
  float background[3];
  uint8_t more_zeros[40];
  SceneFileSpan sections[kSceneFileSections];
};
static_assert(sizeof(SceneFileHead) == 384 && offsetof(SceneFileHead, file_bytes) == 24);
static_assert(sizeof(SceneFileHead) % kSceneFileAlignment == 0);
static_assert(sizeof(SceneBlock) == 308 && offsetof(SceneBlock, mean_middle) == 52,
              "version 1 stores blocks like that");

constexpr uint64_t filled_up(uint64_t bytes) { return round_up<uint64_t>(bytes, kSceneFileAlignment); }

}  // namespace maq
