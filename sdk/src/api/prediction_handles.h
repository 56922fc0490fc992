#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "api/frame_handle.h"
#include "api/handle.h"
#include "maquette/prediction.h"
#include "prediction/codes/frame_decoder.h"
#include "prediction/networks/network_predictor.h"
#include "prediction/predictor.h"
#include "prediction/surprise/surprise.h"

struct maq_predictor : maq::HandleOf<maq::HandleKind::kPredictor> {
  maq_predictor(std::unique_ptr<maq::Predictor> alone, std::unique_ptr<maq::NetworkPredictor> by_networks,
                size_t pool_size)
      : predictor(std::move(alone)), by_network(std::move(by_networks)), frames(pool_size, "predicted frames") {}
  // One of these.
  const std::unique_ptr<maq::Predictor> predictor;
  const std::unique_ptr<maq::NetworkPredictor> by_network;
  maq::BoundedPool<maq_frame> frames;
};

namespace maq {

// What streams of surprise can share.
struct SurpriseNetworks {
  std::shared_ptr<FrameEncoder> encoder;
  std::shared_ptr<FrameDecoder> decoder;
  std::shared_ptr<CodeTransformer> transformer;  // null: the table instead
};

}  // namespace maq

struct maq_surprise : maq::HandleOf<maq::HandleKind::kSurprise> {
  maq_surprise(std::shared_ptr<maq::ContextState> of, maq::SurpriseNetworks networks, float ratio)
      : state(std::move(of)),
        surprise(std::move(networks.encoder), std::move(networks.transformer)),
        decoder(std::move(networks.decoder)),
        event_ratio(ratio) {}
  std::shared_ptr<maq::ContextState> state;
  maq::Surprise surprise;
  std::shared_ptr<maq::FrameDecoder> decoder;
  maq::BoundedPool<maq_frame> pictures{4, "rebuilt pictures"};
  int64_t timestamp_ns = 0;  // of the latest frame
  uint64_t sequence = 0;
  maq_clock clock = MAQ_CLOCK_MEDIA;
  const float event_ratio;
  float push_ms = 0;
  uint64_t pushed = 0, events = 0, starts = 0;
};
