package dev.maquette.sample

import android.app.Activity
import android.graphics.Bitmap
import android.os.Bundle
import android.view.View
import android.widget.Button
import android.widget.ImageView
import android.widget.LinearLayout
import android.widget.TextView
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import java.util.concurrent.Executors

internal fun people(count: Int) = if (count == 1) "1 person" else "$count people"

/** A screen: a sentence, a picture, then buttons; and a thread for all that takes time. */
abstract class Screen : Activity() {
    protected val maquette by lazy { Maquette() }
    protected lateinit var picture: ImageView
    private lateinit var rows: LinearLayout
    private lateinit var sentence: TextView
    private val worker = Executors.newSingleThreadExecutor()

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        // Screen readers say the sentence whenever it changes.
        sentence = TextView(this).apply { accessibilityLiveRegion = View.ACCESSIBILITY_LIVE_REGION_POLITE }
        picture = ImageView(this).apply { adjustViewBounds = true }
        rows =
            LinearLayout(this).apply {
                orientation = LinearLayout.VERTICAL
                fitsSystemWindows = true
                addView(sentence)
                addView(picture, LinearLayout.LayoutParams(LinearLayout.LayoutParams.MATCH_PARENT, 0, 1f))
            }
        setContentView(rows)
    }

    override fun onDestroy() {
        inBackground({ close() }) {}
        worker.shutdown()
        super.onDestroy()
    }

    /** The networks of that name, which come with the library. */
    protected open fun networks(name: String): ModelBundle = ModelBundle.ofAssets(assets, name)

    /** On the worker, at the end. */
    protected open fun close() = maquette.close()

    protected fun say(text: String) {
        sentence.text = text
    }

    protected fun show(bitmap: Bitmap, description: String) {
        picture.setImageBitmap(bitmap)
        picture.contentDescription = description
    }

    protected fun button(
        text: String,
        onClick: () -> Unit,
    ): Button =
        Button(this).also { button ->
            button.text = text
            button.setOnClickListener { onClick() }
            rows.addView(button)
        }

    /** [work] on the worker, then [done] with what it gave on the main thread. What it throws is said. */
    protected fun <T> inBackground(
        work: () -> T,
        done: (T) -> Unit,
    ) = worker.execute {
        val result = runCatching(work)
        runOnUiThread {
            if (!isDestroyed) result.onSuccess(done).onFailure { say(it.message ?: it.toString()) }
        }
    }
}
