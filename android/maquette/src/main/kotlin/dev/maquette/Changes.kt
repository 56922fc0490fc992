package dev.maquette

/**
 * Changes of state of one native object. Each listener gets the latest one, then all that follow, in order, and null at
 * the end. Listeners are called on threads of the library and must return at once.
 *
 * It must not refer to the object itself: native code keeps it until the object is destroyed.
 */
internal class Changes<T : Any>(private val convert: (state: Int, status: Int, text: String) -> T) {
    private val listeners = LinkedHashSet<(T?) -> Unit>()
    private var latest: T? = null
    private var isEnded = false

    /** Called by native code, by its name. */
    @Suppress("unused")
    fun onChange(state: Int, status: Int, utf8: ByteArray) = tell(convert(state, status, utf8.decodeToString()))

    @Synchronized
    fun tell(change: T) {
        if (isEnded) return
        latest = change
        listeners.forEach { it(change) }
    }

    @Synchronized
    fun end() {
        isEnded = true
        listeners.forEach { it(null) }
        listeners.clear()
    }

    @Synchronized
    fun listen(listener: (T?) -> Unit) {
        latest?.let(listener)
        if (isEnded) listener(null) else listeners.add(listener)
    }

    @Synchronized
    fun leave(listener: (T?) -> Unit) {
        listeners.remove(listener)
    }
}
