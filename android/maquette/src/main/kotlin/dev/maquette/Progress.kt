package dev.maquette

/** Receives the progress of a long call, on the thread of that call, which waits meanwhile. */
fun interface Progress {
    /**
     * @param done the finished fraction, 0 to 1.
     * @param stage what runs now, in a sentence.
     * @return false to cancel.
     */
    fun onProgress(done: Double, stage: String): Boolean
}

/** Called by native code, by its name. */
internal class NativeProgress(private val progress: Progress) {
    @Suppress("unused")
    fun onProgress(done: Double, stage: ByteArray): Boolean = progress.onProgress(done, stage.decodeToString())
}
