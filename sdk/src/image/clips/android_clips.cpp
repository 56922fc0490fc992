// Video files on Android: apps use MediaCodec.
#include "core/error.h"
#include "image/clips/clip_reader.h"
#include "image/clips/vp9_encoder.h"

namespace maq {
namespace {

[[noreturn]] void refuse() {
  throw Error(MAQ_ERROR_UNSUPPORTED,
              "Video files are not read or written on Android. Decode or encode them with android.media.MediaCodec.");
}

}  // namespace

struct Vp9Encoder::State {};

Vp9Encoder::Vp9Encoder(int, int) { refuse(); }
Vp9Encoder::~Vp9Encoder() = default;
Vp9Encoder::Packet Vp9Encoder::encode(const ImageView&) { refuse(); }

ClipReader::ClipReader(const std::string&, double) { refuse(); }
ClipReader::Process::~Process() = default;
bool ClipReader::read(ImageView&, int64_t&) { return false; }

}  // namespace maq
