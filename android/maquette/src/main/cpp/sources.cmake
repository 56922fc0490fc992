# The native methods' sources, beside this file: for the AAR and for tests/android.
set(MAQ_JNI_SOURCES
  graphics/hardware_buffer.cpp
  graphics/ndk_graphics.cpp
  graphics/preview.cpp
  jni_android.cpp
  jni_callbacks.cpp
  jni_methods.cpp
)
list(TRANSFORM MAQ_JNI_SOURCES PREPEND "${CMAKE_CURRENT_LIST_DIR}/")
