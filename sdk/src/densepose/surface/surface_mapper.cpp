#include "densepose/surface/surface_mapper.h"

#include <algorithm>

namespace maq {

SurfaceMapper::SurfaceMapper(const DensePoseNetworks& networks, const DensePoseSpec& spec, const std::string& name,
                             const std::string& charts_file, int channels, int surface_channels)
    : spec_(spec.dense_head),
      channels_(channels),
      charts_(networks.bundle().files.at(charts_file), spec_.index_classes - 1,
              networks.bundle().path_of(charts_file)) {
  if (surface_channels == 0) surface_channels = charts_.channels();
  const int64_t pool = spec_.pool_size, classes = spec_.coarse_classes + spec_.index_classes;
  dense_head_ = networks.open(name, graph_with(networks.bundle().manifest, name, {"rois"}, {"labels", "surface"}),
                              {kAnySize, pool, pool, channels},
                              {{kAnySize, pool, pool, 4 * classes}, {kAnySize, pool, pool, surface_channels}},
                              networks.on_provider());
}

void SurfaceMapper::add(const FeatureMap& features, const Box& box) {
  rois_.resize((count_ + 1) * roi_size());
  roi_align_.run(features, box, spec_.pool_size, rois_.data() + count_++ * roi_size());
}

void SurfaceMapper::drop(const std::vector<uint8_t>& keeps) {
  size_t kept = 0;
  for (size_t i = 0; i < count_; ++i) {
    if (keeps[i] == 0) continue;
    if (kept != i) std::copy_n(rois_.data() + i * roi_size(), roi_size(), rois_.data() + kept * roi_size());
    ++kept;
  }
  count_ = kept;
}

void SurfaceMapper::run(RunCancel& cancel) {
  const int64_t people = int64_t(count_);
  inputs_.assign(1, {rois_.data(), {people, spec_.pool_size, spec_.pool_size, channels_}});
  shapes_.assign(2, {people, spec_.pool_size, spec_.pool_size, 4 * (spec_.coarse_classes + spec_.index_classes)});
  shapes_[1][3] = charts_.channels();
  const std::vector<TensorView>& answers = dense_head_->run(inputs_, shapes_, &cancel);
  labels_ = const_cast<float*>(answers[0].data);  // ours until the next run
  surface_ = const_cast<float*>(answers[1].data);
}

SurfaceAnswer SurfaceMapper::answer(size_t index) const {
  return {labels_ + index * labels_size(), surface_ + index * surface_size()};
}

size_t SurfaceMapper::roi_size() const { return size_t(channels_) * size_t(spec_.pool_size) * size_t(spec_.pool_size); }

size_t SurfaceMapper::labels_size() const {
  return size_t(spec_.output_size) * size_t(spec_.output_size) * size_t(spec_.coarse_classes + spec_.index_classes);
}

size_t SurfaceMapper::surface_size() const {
  return size_t(charts_.channels()) * size_t(spec_.pool_size) * size_t(spec_.pool_size);
}

DenseLogits SurfaceMapper::logits_of(const SurfaceAnswer& answer) {
  charts_.begin(answer.surface, spec_.pool_size);
  return {answer.labels, &charts_, spec_.coarse_classes, spec_.index_classes, spec_.output_size};
}

}  // namespace maq
