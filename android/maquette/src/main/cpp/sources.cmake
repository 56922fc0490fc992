# The native methods' sources, beside this file: for the AAR and for tests/android.
set(MAQ_JNI_SOURCES
  graphics/hardware_buffer.cpp
  graphics/ndk_graphics.cpp
  graphics/preview.cpp
  jni_camera_image.cpp
  jni_capture.cpp
  jni_context.cpp
  jni_densepose.cpp
  jni_edges.cpp
  jni_frame.cpp
  jni_head.cpp
  jni_head_building.cpp
  jni_head_rendering.cpp
  jni_image.cpp
  jni_picture.cpp
  jni_pipeline.cpp
  jni_prediction.cpp
  jni_preview.cpp
  jni_scene.cpp
  jni_scene_building.cpp
  jni_source.cpp
  jni_threads.cpp
)
list(TRANSFORM MAQ_JNI_SOURCES PREPEND "${CMAKE_CURRENT_LIST_DIR}/")
