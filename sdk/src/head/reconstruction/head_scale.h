// How large a head is, which its photos do not tell: by a distance on it that is known, or by a depth image.
#pragma once

#include <cstddef>
#include <string>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "head/stored_head.h"

namespace maq::head {

inline constexpr double kMinKnownDistance_m = 1e-3, kMaxKnownDistance_m = 10;

// That by which the two landmarks are `distance_m` apart. Its sigma is the uncertainty of the landmarks' distance.
// Throws MAQ_ERROR_INVALID_ARGUMENT for a distance out of range, and landmarks that are the same or lie within a
// hundredth of a unit; MAQ_ERROR_NOT_FOUND for a name that the head does not have.
HeadScale scale_by_distance(const StoredHead& head, const std::string& from, const std::string& to, double distance_m);

// The scale at which the head lies where `depth` (DEPTH16 or DEPTH32F) sees it: an image of any size, with the view of
// the camera at `camera` saw. The median over pixels of the surface that faces the camera; its sigma is their spread.
// An error of the camera's focal length is one of the size. Throws MAQ_ERROR_INVALID_ARGUMENT for an image that is no
// depth, or of other proportions than the photo; MAQ_ERROR_NOT_FOUND where most of the head's pixels have no depth, or
// none that agrees with the head; what head_surface() and MeshRaster throw.
HeadScale scale_by_depth(const StoredHead& head, size_t camera, const ImageView& depth, WorkerThreads& threads);

}  // namespace maq::head
