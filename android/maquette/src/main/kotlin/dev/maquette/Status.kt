package dev.maquette

/** The outcome of a call into the library (`maq_status` of its C API). */
enum class Status(internal val code: Int) {
    OK(0),
    INVALID_ARGUMENT(1),
    VERSION_MISMATCH(2),
    NOT_FOUND(3),
    UNREADABLE(4),
    IMAGE_SIZE(5),
    BAD_BUNDLE(6),
    UNSUPPORTED(7),
    RUNTIME_LIBRARY(8),
    POOL_EMPTY(9),
    INFERENCE(10),
    OUT_OF_MEMORY(11),
    INTERNAL(12),
    END_OF_STREAM(13),
    TIMEOUT(14),
    DEVICE_LOST(15),
    BUSY(16),
    NO_PERMISSION(17),
    UNWRITABLE(18),
    CANCELLED(19),
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
