package dev.maquette

import dev.maquette.jni.*

/** The outcome of a call into the library (`maq_status` of its C API). */
enum class Status(internal val code: Int) {
    OK(MAQ_OK),
    INVALID_ARGUMENT(MAQ_ERROR_INVALID_ARGUMENT),
    VERSION_MISMATCH(MAQ_ERROR_VERSION_MISMATCH),
    NOT_FOUND(MAQ_ERROR_NOT_FOUND),
    UNREADABLE(MAQ_ERROR_UNREADABLE),
    IMAGE_SIZE(MAQ_ERROR_IMAGE_SIZE),
    BAD_BUNDLE(MAQ_ERROR_BAD_BUNDLE),
    UNSUPPORTED(MAQ_ERROR_UNSUPPORTED),
    RUNTIME_LIBRARY(MAQ_ERROR_RUNTIME_LIBRARY),
    POOL_EMPTY(MAQ_ERROR_POOL_EMPTY),
    INFERENCE(MAQ_ERROR_INFERENCE),
    OUT_OF_MEMORY(MAQ_ERROR_OUT_OF_MEMORY),
    INTERNAL(MAQ_ERROR_INTERNAL),
    END_OF_STREAM(MAQ_END_OF_STREAM),
    TIMEOUT(MAQ_TIMEOUT),
    DEVICE_LOST(MAQ_ERROR_DEVICE_LOST),
    BUSY(MAQ_ERROR_BUSY),
    NO_PERMISSION(MAQ_ERROR_NO_PERMISSION),
    UNWRITABLE(MAQ_ERROR_UNWRITABLE),
    CANCELLED(MAQ_CANCELLED),
    ;

    internal companion object {
        fun of(code: Int): Status = entries.firstOrNull { it.code == code } ?: INTERNAL
    }
}

/** A call into the library failed. The message says what was wrong and what to do. */
class MaquetteException(val status: Status, message: String) : RuntimeException(message) {
    /** Called from native code. */
    @Suppress("unused")
    internal constructor(code: Int, utf8: ByteArray) : this(Status.of(code), String(utf8, Charsets.UTF_8))
}

/** The result of [call]; null if it ends with one of [statuses]. */
internal inline fun <T> orNull(vararg statuses: Status, call: () -> T): T? =
    try {
        call()
    } catch (error: MaquetteException) {
        if (error.status in statuses) null else throw error
    }

/** Receives the progress of a long call, on the thread of that call, which waits meanwhile. */
fun interface Progress {
    /**
     * @param done the finished fraction, 0 to 1.
     * @param stage what runs now, in a sentence.
     * @return false to cancel.
     */
    fun onProgress(done: Double, stage: String): Boolean
}
