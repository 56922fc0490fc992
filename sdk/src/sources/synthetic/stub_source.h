// Sources that draw their own frames, so that everything can be tried without a camera or a file. Frame k is a
// function of the URI and k alone.
#pragma once

#include <memory>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// stub:people (rendered people who walk through the image), stub:pattern (moving colour bars) and stub:solids (depth
// of solids of known size).
std::unique_ptr<Source> open_stub_source(SourceUri uri);

}  // namespace maq
