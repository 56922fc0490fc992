// A head of the person in an image: it forms next to the photo, can be turned, laid over the photo, and exported.
#pragma once

#include <app/live_head.h>
#include <app/saver.h>
#include <optional>
#include <string>

#include "main_view.h"

class HeadView final : public MainView {
 public:
  HeadView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  // `adds_photo`: to those of the head so far.
  void fit(maquette::LiveHeadPhoto photo, bool adds_photo);
  bool has_head() const { return live_.fitted() != nullptr; }
  // The mesh as .glb and the head as .maqh, into the saver's folder.
  void export_head(maquette::Saver& saver) const;

  bool update() override;
  Action press(int key) override;
  void steer(const Steering& steering, const Rect& area) override;
  void draw(const Rect& area) override;
  Action draw_panel() override;

  bool is_moving() const override { return is_moving_; }
  std::string message() const override;
  double images_per_second() const override { return 25; }
  maquette::Saver::Companions companions() const override;

  bool act_alone() override;  // turns the head a little when it is ready
  std::string failure() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  std::shared_ptr<const maquette::LiveHeadState> state() const { return live_.state(); }
  const maquette::LiveHeadImage& image() const { return live_.images().front(); }
  bool shows_slider() const { return !image().photo.empty(); }
  Rect photo_rect(const Rect& area) const;
  Rect head_rect(const Rect& area) const;
  void upload();
  void request_image(bool is_moving, const Rect& area);
  void draw_choices();
  void draw_facts() const;

  maquette::LiveHeadView wanted_;
  float seconds_;  // of the next fit
  bool is_moving_ = false, needs_image_ = true, drags_slider_ = false;
  float slider_ = 0.5f;
  Rect requested_area_;
  uint64_t image_count_ = 0, acted_on_ = 0;
  std::optional<uint64_t> first_of_ready_;  // the count of images when the head was ready, without a user
  std::shared_ptr<const maquette::RgbaImage> uploaded_photo_;
  maquette::LiveHead live_;  // last: its threads wake the window
};
