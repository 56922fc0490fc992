// The tiny bundle opened for the parts of dense pose, each of which is tested alone.
#pragma once

#include <algorithm>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "densepose/bundle/manifest.h"
#include "densepose/bundle/networks.h"
#include "densepose/bundle/settings.h"
#include "densepose/detector/rotated_input.h"

struct TinyDensePose {
  TinyDensePose() {
    settings.long_side_px = spec.long_side_px;
    settings.score_threshold = spec.box_head.score_threshold;
    settings.max_people = spec.box_head.max_people;
    settings.max_proposals = spec.rpn.post_nms_top_k;
    settings.crop_side_px = 128;
  }

  // The image as the networks see it without scaling.
  static maq::RotatedInput unscaled(const cv::Mat& image) {
    return maq::rotated_input(image.cols, image.rows, std::max(image.cols, image.rows), 0);
  }
  static maq::ImageView view(const cv::Mat& bgr) {
    return {MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, {{bgr.data, bgr.step}, {}}};
  }

  const std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime =
      std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  const maq::Bundle bundle = maq::read_bundle(std::string(MAQ_TEST_DATA) + "/tiny_bundle");
  const maq::DensePoseSpec spec = maq::read_densepose_spec(bundle.manifest);
  maq::DensePoseSettings settings;
  const maq::DensePoseNetworks networks{runtime, bundle, 1, MAQ_PROVIDER_CPU};
  maq::RunCancel cancel{runtime};
};
