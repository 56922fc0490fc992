// The prediction methods of the C API and of the engine.
#pragma once

#include "maquette/prediction.h"
#include "prediction/frame_predictor.h"

namespace maq {

static_assert(int(PredictionMethod::kAuto) == MAQ_PREDICTOR_AUTO && int(PredictionMethod::kLast) == MAQ_PREDICTOR_LAST);
static_assert(int(PredictionMethod::kMotion) == MAQ_PREDICTOR_MOTION);
static_assert(int(PredictionMethod::kSampled) == MAQ_PREDICTOR_SAMPLED);

// The value is in range.
inline PredictionMethod method_of(maq_predictor_method method) { return PredictionMethod(int(method)); }
inline maq_predictor_method method_of(PredictionMethod method) { return maq_predictor_method(int(method)); }

}  // namespace maq
