// The settings of dense pose.
#pragma once

#include "maquette/types.h"

namespace maq {

enum class PersonCrops { kOff, kAuto, kAll };  // see maq_densepose_crops

// See maq_densepose_config. 0 (a negative threshold): the bundle's value.
struct DensePoseSettings {
  int threads = 1;       // or MAQ_THREADS_MEASURED
  int long_side_px = 0;  // 0: by the people in the image, from the bundle's value up
  float score_threshold = -1;
  int max_people = 0;
  int max_proposals = 0;
  int key_frame_interval = 1;
  float steadiness = 0.9f;  // of the surface in a stream, from 0 (off) to below 1
  int min_person_height_px = 0;
  PersonCrops crops = PersonCrops::kOff;
  int crop_side_px = 0;
  bool surface = true;
  bool keypoints = false;
  maq_provider provider = MAQ_PROVIDER_CPU;
};

}  // namespace maq
