package dev.maquette.sample

import android.opengl.EGL14
import android.opengl.EGLConfig
import android.opengl.GLES11Ext
import android.opengl.GLES20

/** A texture for ARCore to draw the camera's pictures into, and the OpenGL context of the calling thread for it. */
class OffscreenTexture : AutoCloseable {
    private val display = EGL14.eglGetDisplay(EGL14.EGL_DEFAULT_DISPLAY)
    private val config: EGLConfig
    private val context: android.opengl.EGLContext
    private val surface: android.opengl.EGLSurface
    val name: Int

    init {
        check(EGL14.eglInitialize(display, IntArray(1), 0, IntArray(1), 0)) { "This device has no OpenGL." }
        val configs = arrayOfNulls<EGLConfig>(1)
        val wanted =
            intArrayOf(
                EGL14.EGL_RENDERABLE_TYPE, EGL14.EGL_OPENGL_ES2_BIT,
                EGL14.EGL_SURFACE_TYPE, EGL14.EGL_PBUFFER_BIT,
                EGL14.EGL_NONE,
            )
        EGL14.eglChooseConfig(display, wanted, 0, configs, 0, 1, IntArray(1), 0)
        config = checkNotNull(configs[0]) { "This device has no OpenGL ES 2." }
        val version2 = intArrayOf(EGL14.EGL_CONTEXT_CLIENT_VERSION, 2, EGL14.EGL_NONE)
        context = EGL14.eglCreateContext(display, config, EGL14.EGL_NO_CONTEXT, version2, 0)
        val onePixel = intArrayOf(EGL14.EGL_WIDTH, 1, EGL14.EGL_HEIGHT, 1, EGL14.EGL_NONE)
        surface = EGL14.eglCreatePbufferSurface(display, config, onePixel, 0)
        check(EGL14.eglMakeCurrent(display, surface, surface, context)) { "OpenGL cannot be used on this thread." }
        name = IntArray(1).also { GLES20.glGenTextures(1, it, 0) }[0]
        GLES20.glBindTexture(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, name)
    }

    override fun close() {
        val none = EGL14.EGL_NO_SURFACE
        EGL14.eglMakeCurrent(display, none, none, EGL14.EGL_NO_CONTEXT)
        EGL14.eglDestroySurface(display, surface)
        EGL14.eglDestroyContext(display, context)
    }
}
