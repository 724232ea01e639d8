"""The report's page: text and style around the figures, in jinja's notation."""

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ headline }}: {{ result.run.source }}</title>
<style>
:root { color-scheme: light; --ink: #1f2933; --soft: #52606d; --line: #e4e7eb; --good: #2f7de1; --warn: #d64545; }
body { font: 15px/1.55 system-ui, "Segoe UI", Roboto, sans-serif; color: var(--ink); max-width: 62rem;
       margin: 2rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.6rem; margin: 0 0 .25rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
.verdict { border-left: 6px solid var(--{{ "good" if result.verdict.value != "unexplained" else "warn" }});
           padding: .9rem 1.2rem; background: #f5f7fa; border-radius: 4px; }
.verdict p { margin: .3rem 0 0; font-size: 1.05rem; } .soft { color: var(--soft); }
table { border-collapse: collapse; width: 100%; margin: .4rem 0 1rem; }
th, td { text-align: left; padding: .3rem .7rem .3rem 0; border-bottom: 1px solid var(--line); }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
svg { max-width: 100%; height: auto; } figure { margin: .5rem 0 1.2rem; }
figcaption { color: var(--soft); font-size: .9rem; }
pre { background: #f5f7fa; padding: .8rem 1rem; border-radius: 4px; overflow-x: auto; font-size: 13px; }
.effect { border: 1px solid var(--line); border-radius: 6px; padding: .8rem 1.1rem; margin: .8rem 0; }
.effect h3 { margin: 0 0 .2rem; font-size: 1.05rem; }
</style></head><body>
<div class="verdict"><h1>{{ headline }}</h1><p>{{ result.sentence }}</p></div>
{% if result.interrupted %}
<p class="soft">The search was interrupted; this is what was known by then.</p>
{% endif %}
<p class="soft">Run {{ result.run.source }}, model {{ result.run.model }}.</p>

{% if effects %}
<h2>What was found</h2>
{% for effect, rows in effects %}
<div class="effect">
<h3>{{ effect.name }} on {{ effect.channel.value }}
<span class="soft">confidence {{ "%.0f"|format(100 * effect.confidence) }} %</span></h3>
<p>{{ effect.why }}</p>
{% if effect.alternatives %}
<p>The data cannot tell it from: <b>{{ effect.alternatives | join(", ") }}</b>.</p>
{% endif %}
<table>{% for name, text in rows %}<tr><td>{{ name }}</td><td>{{ text }}</td></tr>{% endfor %}</table>
{% if effect.check %}<p><b>On the rig:</b> {{ effect.check }}</p>{% endif %}
</div>
{% endfor %}
{% endif %}
{% if result.next_experiment %}
<h2>Next experiment</h2>
<p>{{ result.next_experiment.why }}</p>
<table>{% for name, value in result.next_experiment.to_json().waveform.items() %}
<tr><td>{{ name }}</td><td>{{ value }}</td></tr>{% endfor %}</table>
{% endif %}

<h2>How far the gap shrinks</h2>
<table><tr><th>channel</th><th>run</th><th>model</th><th class="n">RMS</th><th class="n">ISE</th>
<th class="n">fit</th><th class="n">RMS / noise</th></tr>
{% for row in gap_rows %}
<tr><td>{{ row.channel }}</td><td>{{ row.run }}</td><td>{{ row.model }}</td><td class="n">{{ row.rms }}</td>
<td class="n">{{ row.ise }}</td><td class="n">{{ row.fit }}</td><td class="n">{{ row.over }}</td></tr>
{% endfor %}</table>
{% for name, picture in traces %}
<figure>{{ picture | safe }}<figcaption>{{ name }}, this run: measured, simulated before and after, and what is left.
</figcaption></figure>
{% endfor %}
{% for name, picture in validation %}
<figure>{{ picture | safe }}
<figcaption>{{ name }}, validation run, which no parameter was fitted to.</figcaption></figure>
{% endfor %}

{% if where %}
<h2>Where the given model and the data disagree</h2>
<figure>{{ where | safe }}
<figcaption>A bar of the gap much longer than its bar of time marks the condition.</figcaption>
</figure>
{% endif %}

{% if rankings %}
<h2>Candidates</h2>
<p class="soft">Each was fitted by simulation error together with the nominal parameters. Behind the best is twice the
log-likelihood by which a candidate trails, its complexity paid with the effective number of samples.</p>
{% for name, rows, picture in rankings %}
<figure>{{ picture | safe }}<figcaption>{{ name }}</figcaption></figure>
<table><tr><th>candidate</th><th class="n">explains</th><th class="n">behind the best</th></tr>
{% for row in rows %}
<tr><td>{{ row.names | join(" + ") or "parameters alone" }}
{{ "" if row.inside_vocabulary else " (no name of ours)" }}</td>
<td class="n">{{ "%.1f"|format(100 * row.explained) }} %</td>
<td class="n">{{ "%.1f"|format(row.behind_best) }}</td></tr>
{% endfor %}</table>
{% endfor %}
{% endif %}

{% if nominal %}
<h2>Nominal parameters after the fit</h2>
<table>{% for name, text in nominal %}
<tr><td>{{ name }}</td><td>{{ text }}</td></tr>{% endfor %}</table>
{% endif %}
{% if result.data_notes %}
<h2>What the data allow</h2>
<ul>{% for note in result.data_notes %}<li>{{ note }}</li>{% endfor %}</ul>
{% endif %}

<h2>The model</h2>
<pre>{{ model }}</pre>
{% if reproduce %}
<h2>How to get this again</h2>
<table>{% for name, value in reproduce.items() %}
<tr><td>{{ name }}</td><td><code>{{ value }}</code></td></tr>{% endfor %}
</table>
{% endif %}
</body></html>
"""
