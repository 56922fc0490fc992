// A head's texture in the texture coordinates of the template head.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "head/head_template.h"
#include "head/texture/texture_bake.h"

namespace maq::head {

// Resamples a texture of texture_layout.h. `points`: the template point that the head's surface has at each point of
// the template, [points][3], dm; `colours`: of each vertex, R, G, B; those of mouth, teeth and tongue are painted, as
// bright as the face. What other skin covers, such as the inside of the lids, continues the skin around it. What lids
// cover of an eyeball is as white as the rest of it. The texture has twice the pixels of `from`, up to kMaxTexture_px a
// side: the template's coordinates need more room. The same for any number of threads.
TextureImage texture_on_template(const TextureImage& from, const HeadTemplate& onto, const std::vector<float>& points,
                                 const std::vector<uint8_t>& colours, WorkerThreads& threads);

}  // namespace maq::head
