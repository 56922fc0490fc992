#include "image/clips/vp9_encoder.h"

#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

#include <new>

#include "core/error.h"

namespace maq {
namespace {

constexpr unsigned kQuality = 24;    // 0 to 63: the least is the best
constexpr int kSpeed = 9;            // the fastest
constexpr unsigned kKeyFrames = 60;  // apart at most, so that players can seek
constexpr unsigned long kEachFrame = 1;

// BT.601 in video range, in 16 bits of fraction.
struct Yuv {
  static uint8_t y(int r, int g, int b) {
    return uint8_t((16829 * r + 33039 * g + 6416 * b + (16 << 16) + 32768) >> 16);
  }
  // Take sums of four pixels.
  static uint8_t u(int r, int g, int b) {
    return uint8_t((-9714 * r - 19070 * g + 28784 * b + (128 << 18) + 131072) >> 18);
  }
  static uint8_t v(int r, int g, int b) {
    return uint8_t((28784 * r - 24103 * g - 4681 * b + (128 << 18) + 131072) >> 18);
  }
};

void convert(const ImageView& bgr, vpx_image_t& image) {
  for (int y = 0; y < bgr.height_px; y += 2) {
    const uint8_t* from[2];
    uint8_t* to[2];
    for (int k = 0; k < 2; ++k) {
      from[k] = bgr.planes[0].data + size_t(y + k) * bgr.planes[0].stride_bytes;
      to[k] = image.planes[VPX_PLANE_Y] + ptrdiff_t(y + k) * image.stride[VPX_PLANE_Y];
    }
    uint8_t* const u = image.planes[VPX_PLANE_U] + ptrdiff_t(y / 2) * image.stride[VPX_PLANE_U];
    uint8_t* const v = image.planes[VPX_PLANE_V] + ptrdiff_t(y / 2) * image.stride[VPX_PLANE_V];
    for (int x = 0; x < bgr.width_px; x += 2) {
      int sums[3] = {};
      for (int k = 0; k < 2; ++k) {
        for (int i = x; i < x + 2; ++i) {
          const uint8_t* const pixel = from[k] + 3 * i;
          to[k][i] = Yuv::y(pixel[2], pixel[1], pixel[0]);
          for (int c = 0; c < 3; ++c) sums[c] += pixel[c];
        }
      }
      u[x / 2] = Yuv::u(sums[2], sums[1], sums[0]);
      v[x / 2] = Yuv::v(sums[2], sums[1], sums[0]);
    }
  }
}

[[noreturn]] void fail(vpx_codec_err_t error) {
  if (error == VPX_CODEC_MEM_ERROR) throw std::bad_alloc();
  throw Error(MAQ_ERROR_INTERNAL, "An image could not be encoded as VP9: ", vpx_codec_err_to_string(error), ".");
}

void check(vpx_codec_err_t error) {
  if (error != VPX_CODEC_OK) fail(error);
}

}  // namespace

struct Vp9Encoder::State {
  State(int width_px, int height_px) {
    vpx_codec_enc_cfg_t config;
    check(vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0));
    config.g_w = unsigned(width_px);
    config.g_h = unsigned(height_px);
    config.g_threads = 1;
    config.g_lag_in_frames = 0;  // each image is a packet at once
    config.rc_end_usage = VPX_Q;
    config.kf_max_dist = kKeyFrames;
    const vpx_codec_err_t error = vpx_codec_enc_init(&codec, vpx_codec_vp9_cx(), &config, 0);
    if (error == VPX_CODEC_INVALID_PARAM) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "VP9 has no images of ", width_px, " x ", height_px, " pixels.");
    }
    check(error);
    is_open = true;
    if (vpx_codec_control(&codec, VP8E_SET_CPUUSED, kSpeed) != VPX_CODEC_OK ||
        vpx_codec_control(&codec, VP8E_SET_CQ_LEVEL, kQuality) != VPX_CODEC_OK ||
        vpx_codec_control(&codec, VP9E_SET_COLOR_SPACE, VPX_CS_BT_601) != VPX_CODEC_OK ||
        vpx_img_alloc(&image, VPX_IMG_FMT_I420, config.g_w, config.g_h, 32) == nullptr) {
      close();
      throw std::bad_alloc();
    }
    image.cs = VPX_CS_BT_601;
  }
  ~State() { close(); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void close() {
    vpx_img_free(&image);
    if (is_open) vpx_codec_destroy(&codec);
    is_open = false;
  }

  vpx_codec_ctx_t codec{};
  vpx_image_t image{};
  vpx_codec_pts_t number = 0;
  bool is_open = false;
};

Vp9Encoder::Vp9Encoder(int width_px, int height_px) : state_(std::make_unique<State>(width_px, height_px)) {}

Vp9Encoder::~Vp9Encoder() = default;

Vp9Encoder::Packet Vp9Encoder::encode(const ImageView& bgr) {
  convert(bgr, state_->image);
  check(vpx_codec_encode(&state_->codec, &state_->image, state_->number++, kEachFrame, 0, VPX_DL_REALTIME));
  vpx_codec_iter_t iterator = nullptr;
  const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(&state_->codec, &iterator);
  while (packet != nullptr && packet->kind != VPX_CODEC_CX_FRAME_PKT) {
    packet = vpx_codec_get_cx_data(&state_->codec, &iterator);
  }
  if (packet == nullptr) fail(VPX_CODEC_ERROR);
  return {static_cast<const uint8_t*>(packet->data.frame.buf), packet->data.frame.sz,
          (packet->data.frame.flags & VPX_FRAME_IS_KEY) != 0};
}

}  // namespace maq
