package dev.maquette.sample

import android.app.Activity
import android.graphics.Bitmap
import android.os.Build
import android.os.Bundle
import android.view.View
import android.view.ViewGroup.LayoutParams.MATCH_PARENT
import android.view.ViewGroup.LayoutParams.WRAP_CONTENT
import android.widget.Button
import android.widget.GridLayout
import android.widget.ImageView
import android.widget.LinearLayout
import android.widget.ScrollView
import android.widget.TextView
import dev.maquette.Maquette
import dev.maquette.ModelBundle
import java.util.concurrent.Executors

internal fun people(count: Int) = if (count == 1) "1 person" else "$count people"

/**
 * A screen: a sentence, a picture, then buttons; and a thread for all that takes time. Dark where the system is.
 *
 * @param columns of buttons.
 */
abstract class Screen(private val columns: Int = 2) : Activity() {
    protected val maquette by lazy { Maquette() }
    protected lateinit var picture: ImageView
    private lateinit var rows: LinearLayout
    private lateinit var buttons: GridLayout
    private lateinit var sentence: TextView
    private val worker = Executors.newSingleThreadExecutor()

    override fun onCreate(state: Bundle?) {
        // Android 10 began to be dark; the manifest's theme is for those before.
        if (Build.VERSION.SDK_INT >= 29) setTheme(android.R.style.Theme_DeviceDefault_DayNight)
        super.onCreate(state)
        // Screen readers say the sentence whenever it changes.
        sentence = TextView(this).apply { accessibilityLiveRegion = View.ACCESSIBILITY_LIVE_REGION_POLITE }
        val colours = theme.obtainStyledAttributes(intArrayOf(android.R.attr.textColorPrimary))
        sentence.setTextColor(colours.getColorStateList(0)) // a text view's own stands out too little
        colours.recycle()
        val edge = (EDGE_DP * resources.displayMetrics.density).toInt()
        sentence.setPadding(edge, 0, edge, edge / 2)
        picture = ImageView(this).apply { contentDescription = "No picture yet" }
        buttons = GridLayout(this).apply { columnCount = columns }
        rows =
            LinearLayout(this).apply {
                orientation = LinearLayout.VERTICAL
                fitsSystemWindows = true
                addView(sentence)
                addView(picture, LinearLayout.LayoutParams(MATCH_PARENT, 0, 1f))
                // They scroll where letters are large and the display is small.
                addView(ScrollView(context).apply { addView(buttons, MATCH_PARENT, WRAP_CONTENT) })
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

    /** This screen shows none. */
    protected fun removePicture() = rows.removeView(picture)

    protected fun button(text: String, onClick: () -> Unit): Button =
        Button(this).also { button ->
            button.text = text
            button.setOnClickListener { onClick() }
            val place = GridLayout.spec(GridLayout.UNDEFINED)
            val across = GridLayout.spec(GridLayout.UNDEFINED, GridLayout.FILL, 1f)
            buttons.addView(button, GridLayout.LayoutParams(place, across).apply { width = 0 })
        }

    /** [work] on the worker, then [done] with what it gave on the main thread. What it throws is said. */
    protected fun <T> inBackground(work: () -> T, done: (T) -> Unit) = worker.execute {
        val result = runCatching(work)
        runOnUiThread {
            if (!isDestroyed) result.onSuccess(done).onFailure { say(it.message ?: it.toString()) }
        }
    }

    private companion object {
        const val EDGE_DP = 16
    }
}
