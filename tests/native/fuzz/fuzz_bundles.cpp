// Bundles: manifests of each system, and the files of the prediction bundle.
#include "body/model/body_file.h"
#include "checked_file.h"
#include "core/json/json_value.h"
#include "densepose/bundle/manifest.h"
#include "densepose/surface/chart_predictor.h"
#include "densepose/surface/surface_grid.h"
#include "edges/edge_network.h"
#include "head/bundle/head_bundle.h"
#include "nn/bundle.h"
#include "prediction/codec/code_bundle.h"
#include "prediction/codec/code_file.h"
#include "prediction/transformer/embedding_file.h"
#include "prediction/transformer/transformer_bundle.h"
#include "scene/networks/scene_networks.h"

using namespace maq;

FUZZ(json) {
  try {
    JsonValue::parse(fuzz::text_of(bytes));
  } catch (const JsonError&) {
  }
}

// A manifest, and, behind a byte 0, the content of each of its files.
FUZZ(bundle) {
  const auto end = std::find(bytes.begin(), bytes.end(), uint8_t(0));
  const std::string text(bytes.begin(), end);
  const fuzz::Bytes content(end == bytes.end() ? end : end + 1, bytes.end());
  std::vector<NamedBuffer> buffers = {{"manifest.json", text.data(), text.size()}};
  Bundle bundle{"memory:", {"", "", "", "", {}, {}, ManifestNode::parse("{}", "none")}, {}};
  bool is_read = false;
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    bundle.manifest = parse_manifest(text, "manifest.json");
    is_read = true;
  });
  if (!is_read) return;
  for (const auto& [name, spec] : bundle.manifest.files) {
    buffers.push_back({name, content.data(), content.size()});
    bundle.files[name] = content;
  }
  const auto with = [&](auto&& make) {
    fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED}, [&] { make(Bundle(bundle)); });
  };
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED, MAQ_ERROR_INVALID_ARGUMENT},
                      [&] { read_bundle(buffers); });
  with([](Bundle given) { read_densepose_spec(given.manifest); });
  with([](Bundle given) { head::HeadBundle{std::move(given)}; });
  with([](Bundle given) { TransformerBundle{CodeBundle{std::move(given)}}; });
  with([](Bundle given) { SceneNetworks(nullptr, std::move(given), {}); });
  with([](Bundle given) { body::model_of_bundle(given); });
  with([](Bundle given) { EdgeNetwork(nullptr, std::move(given), {}); });
}

FUZZ(code_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const FrameCodes codes = read_code_file(file.data(), file.size(), "codes.maqc");
    fuzz::require(codes.vectors.size() == codes.groups * codes.entries * codes.width, "the vectors of codes");
  });
}

FUZZ(embedding_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED},
                      [&] { read_embedding_file(file.data(), file.size(), "transformer.maqr"); });
}

FUZZ(surface_files) {
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE}, [&] { decode_surface_grid(bytes, "surface.grid"); });
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE}, [&] { ChartPredictor(bytes, 24, "charts.f32"); });
}
