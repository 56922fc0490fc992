// Maquette for C++17: classes and exceptions over the C API, in headers alone. The C headers document each call.
//
//   maquette::Context context;
//   maquette::Source source(context, "video:clip.mp4");
//   maquette::DensePose densepose(context);
//   while (auto frame = source.next()) {
//     auto result = densepose.run(*frame);
//     for (const maq_densepose_person& person : result.people()) …
//   }
//
// Every class owns one handle, can be moved but not copied, and returns the handle by get(). Calls that fail throw
// maquette::Error.
#ifndef MAQUETTE_MAQUETTE_HPP_
#define MAQUETTE_MAQUETTE_HPP_

#include "maquette/context.hpp"
#include "maquette/frame.hpp"
#include "maquette/image.hpp"
#include "maquette/maquette.h"
#include "maquette/pipeline.hpp"
#include "maquette/source.hpp"
#if MAQ_HAS_DENSEPOSE
#include "maquette/densepose.hpp"
#include "maquette/densepose_model.hpp"
#include "maquette/densepose_texture.hpp"
#endif
#if MAQ_HAS_SCENES
#include "maquette/scene.hpp"
#endif
#if MAQ_HAS_EDGES
#include "maquette/edges.hpp"
#include "maquette/edges_model.hpp"
#endif
#if MAQ_HAS_HEADS
#include "maquette/head.hpp"
#endif
#if MAQ_HAS_PREDICTION
#include "maquette/prediction.hpp"
#include "maquette/prediction_model.hpp"
#endif
#if MAQ_HAS_BODY
#include "maquette/body.hpp"
#endif

#endif  // MAQUETTE_MAQUETTE_HPP_
